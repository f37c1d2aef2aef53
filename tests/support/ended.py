"""How a command ended."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Ended:
    """status: 0 where the command did what it was asked, negative where a signal ended it."""

    status: int
    out: str
    err: str

    @property
    def told(self) -> str:
        """All that it printed."""
        return self.out + self.err

    @property
    def said(self) -> str:
        """All that it printed, on one line."""
        return " ".join(f"{self.out} {self.err}".split())
