"""One check of a claim: what was looked at, its figure, its threshold, and a sentence."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Result = Literal["pass", "fail", "cannot_tell"]
PASS: Result = "pass"
FAIL: Result = "fail"
CANNOT: Result = "cannot_tell"


@dataclass(frozen=True)
class Check:
    """name: of what was looked at. figure beside threshold: a failed check's is on the wrong side; None where there is
    no number. says: one sentence. decides: whether a claim needs it: where it fails there is none, and where it cannot
    tell the table is undecided."""

    name: str
    result: Result
    figure: float | None
    threshold: float | None
    says: str
    decides: bool = True

    def plain(self) -> dict[str, Any]:
        """As referee.json holds it."""
        return asdict(self)
