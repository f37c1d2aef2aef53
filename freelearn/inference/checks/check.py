"""One check of a table: what was looked at, its figure, its threshold, a sentence, and what to do."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Status = Literal["pass", "fail", "cannot_tell"]
PASS: Status = "pass"
FAIL: Status = "fail"
CANNOT: Status = "cannot_tell"


@dataclass(frozen=True)
class TableCheck:
    """name: of what was looked at. figure beside threshold: a failed check's is on the wrong side; None where there is
    no number. says: one sentence: what, where, and what to do. cure: as options of the command, where there are such.
    """

    name: str
    status: Status
    figure: float | None
    threshold: float | None
    says: str
    cure: str = ""

    @property
    def sentence(self) -> str:
        """What it says, and the option that would mend it."""
        return f"{self.says} Try {self.cure}." if self.cure else self.says

    def plain(self) -> dict[str, Any]:
        """As discovery.json holds it."""
        return asdict(self)
