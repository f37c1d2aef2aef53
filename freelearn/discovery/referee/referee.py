"""All checks of a claim, and what they make of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from freelearn.discovery.referee.black_box import black_box
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, Case, Check
from freelearn.discovery.referee.levels import LeftOut, levels_left_out
from freelearn.discovery.referee.parameter_checks import parameters
from freelearn.discovery.referee.residual_patterns import patterns, stated
from freelearn.discovery.referee.steadiness import steadiness

CLAIMS = ("adequate", "named", "class", "proposed")


@dataclass(frozen=True)
class Referee:
    """checks: all that were made. left: what was left out and truly refitted."""

    checks: list[Check]
    left: list[LeftOut] = field(default_factory=list)

    @property
    def failed(self) -> list[Check]:
        """Checks that stand against any claim."""
        return [c for c in self.checks if c.result == FAIL and c.decides]

    @property
    def stands(self) -> bool:
        """Whether nothing stands against a claim, and no more than usual has to be laid on a few places."""
        return not self.failed and not any(left.by_few for left in self.left)

    @property
    def open(self) -> list[Check]:
        """Checks that a claim would need, and that the table cannot make."""
        return [c for c in self.checks if c.result == CANNOT and c.decides]

    @property
    def sees_nothing(self) -> bool:
        """Whether the black box was there to see and saw nothing, and what was left out was predicted as well as noise
        lets it."""
        looked = [c for c in self.checks if c.name.startswith("black box") or c.name.endswith("left out")]
        return bool(looked) and all(c.result == PASS for c in looked if c.decides)

    def verdict(self, claimed: str) -> str:
        """What remains of a claim."""
        if claimed not in CLAIMS:
            return claimed
        if self.failed:
            return "unexplained"
        return "undecided" if self.open else claimed


def refereed(case: Case, more: Sequence[Check] = ()) -> Referee:
    """The standing checks of a case. more: checks that only the search can make."""
    checks, left = levels_left_out(case)
    found = [*stated(case), *parameters(case), *black_box(case), *checks, *patterns(case), *steadiness(case), *more]
    return Referee(found, left)
