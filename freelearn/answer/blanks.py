"""What of each row is asked for, and whether the rest can tell it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.nearest import MOST_ASKED
from freelearn.answer.system import System


@dataclass(frozen=True)
class Pattern:
    """What is blank alike in some rows. rows: (n,) int64. asked: places of the inputs to find. given: places of the
    outputs that they have to meet. why: why nothing can be answered, if so."""

    rows: Tensor
    asked: tuple[int, ...]
    given: tuple[int, ...]
    why: str = ""

    @property
    def square(self) -> bool:
        """Whether there are as many equations as unknowns."""
        return len(self.asked) == len(self.given)

    @property
    def blank(self) -> tuple[int, ...]:
        """Outputs that follow."""
        return tuple(i for i in (0, 1) if i not in self.given)

    def free(self, system: System, hung: bool) -> tuple[int, ...]:
        """Which of length and twist nothing holds, so that they must stay by themselves. hung: whether the bed hangs
        loads on the actuator. Where a place and all loads are given, something holds it."""
        if not system.mechanical:
            return ()
        loose = [i for i in (0, 1) if i in self.asked]
        if len(self.given) == 2 and (loose or hung):
            return (0, 1)
        return tuple(i for i in loose if i in self.given)


def patterns(system: System, x: Tensor, y: Tensor) -> Iterator[Pattern]:
    """The rows by what is blank in them: inputs x (N, m) and outputs y (N, 2), NaN where they are blank."""
    blank = torch.cat([x.isnan(), y.isnan()], dim=1)
    # One number for each kind: faster to tell apart than rows of truths.
    kinds, kind = torch.unique((blank.long() << torch.arange(blank.shape[1])).sum(1), return_inverse=True)
    for number, code in enumerate(kinds.tolist()):
        each = [bool(code >> i & 1) for i in range(blank.shape[1])]
        asked = tuple(i for i, empty in enumerate(each[:-2]) if empty)
        given = tuple(i for i, empty in enumerate(each[-2:]) if not empty)
        rows = torch.nonzero(kind == number)[:, 0]
        yield Pattern(rows, asked, given, _why_not(system, asked, given))


def _why_not(system: System, asked: tuple[int, ...], given: tuple[int, ...]) -> str:
    """Why such a row has no answer; "" where it has one."""
    pressures = [i for i in asked if i >= 2]
    places = [i for i in asked if i < 2]
    # Of several pressures the least are taken; one is found like any other input.
    needed = len(places) + bool(pressures)
    if needed <= len(given) and len(asked) <= MOST_ASKED:
        return ""
    if len(asked) > MOST_ASKED:
        return f"too many blanks: at most {MOST_ASKED} can be found at once"
    # Named by their columns, once each.
    names = " and ".join(dict.fromkeys(system.inputs[i].name for i in asked))
    outputs = [system.bed.readings[i].column for i in (0, 1) if i not in given]
    short = needed - len(given)
    many = "one blank too many" if short == 1 else f"{short} blanks too many"
    if len(outputs) >= short:
        return f"{many} to find {names}: give {' and '.join(outputs[:short]) if short == 2 else ' or '.join(outputs)}"
    left = {1: "one of them", 2: "two of them"}[short - len(outputs)]
    return f"{many} to find {names}: give {' and '.join([*outputs, left])}"
