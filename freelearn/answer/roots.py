"""Newton's method from many starts at once, and the different answers that it finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.system import System
from freelearn.models.prediction import Status
from freelearn.models.row_systems import divide

MAX_ITERATIONS = 25
# A last Newton step this small, in cells of the grid or in what counts as one, leaves an error of about its square.
TOLERANCE = 1e-7
# Longest step in cells; answers nearer to each other than this many cells are one.
LONGEST, SAME = 2.0, 1e-4
# How far from an answer that gives way its partner is looked for, in cells.
PARTNERS = (0.1, 0.4, 1.2)
# So far beside an answer, in cells, it is seen how the derivatives change.
ASIDE = 0.05


# Rows, inputs, and the outputs' derivatives of some answers.
Found = tuple[Tensor, Tensor, Tensor]


@dataclass(frozen=True)
class Roots:
    """Answers of some rows of a system: row (c,) int64; x (c, m) all inputs there; outputs (c, 2) and their derivatives
    slopes (c, 2, m); status (c,) of Status; stable (c,) bool, whether what is free to move stays there."""

    row: Tensor
    x: Tensor
    outputs: Tensor
    slopes: Tensor
    status: Tensor
    stable: Tensor

    def __len__(self) -> int:
        return len(self.row)

    def __getitem__(self, which: Tensor) -> Roots:
        return Roots(*(getattr(self, name)[which] for name in ("row", "x", "outputs", "slopes", "status", "stable")))

    @classmethod
    def none(cls, inputs: int) -> Roots:
        """No answers."""
        return cls(
            torch.zeros(0, dtype=torch.int64),
            torch.zeros(0, inputs, dtype=torch.float64),
            torch.zeros(0, 2, dtype=torch.float64),
            torch.zeros(0, 2, inputs, dtype=torch.float64),
            torch.zeros(0, dtype=torch.uint8),
            torch.zeros(0, dtype=torch.bool),
        )

    @classmethod
    def joined(cls, parts: Sequence[Roots]) -> Roots:
        """All of several, in their order."""
        names = ("row", "x", "outputs", "slopes", "status", "stable")
        return cls(*(torch.cat([getattr(part, name) for part in parts]) for name in names))


def newton(
    system: System,
    row: Tensor,
    x: Tensor,
    asked: Sequence[int],
    given: Sequence[int],
    wanted: Tensor,
    size: Tensor,
    tolerance: float = TOLERANCE,
    most: int = MAX_ITERATIONS,
) -> tuple[Tensor, Tensor, Tensor]:
    """Inputs (c, m) at which the outputs `given` are as wanted (c, a), from starts x (c, m) of rows (c,), by moving as
    many inputs `asked`; outputs' derivatives (c, 2, m) at the last place looked at; and which have settled, (c,) bool.

    size: of a cell of the grid, (c, a). With one last step after the derivatives were taken, the error is about the
    square of the tolerance.
    """
    given, asked = list(given), list(asked)
    x, settled = x.clone(), torch.zeros(len(x), dtype=torch.bool)
    slopes = torch.full((len(x), 2, x.shape[1]), torch.nan, dtype=x.dtype)
    # Rows that are worked on; picked anew only when half of them have come to their end: picking costs as much.
    going, ended = torch.arange(len(x)), torch.zeros(len(x), dtype=torch.bool)
    part = system[row]
    for _ in range(most):
        outputs, rate = part.slopes(x[going])
        slopes[going] = torch.where(ended[going][:, None, None], slopes[going], rate)
        miss = outputs[:, given] - wanted[going]
        by_asked = rate[:, given][:, :, asked] * size[going, None, :]
        step = -miss / by_asked[:, 0] if len(asked) == 1 else -divide(miss, by_asked)
        lost = ~step.isfinite().all(-1)
        done = (step.abs() <= tolerance).all(-1)
        # All of a step is shortened, so that it keeps its direction.
        longest = step.abs().amax(-1, keepdim=True)
        step = step * torch.clamp(LONGEST / longest, max=1.0)
        moved = x[going]
        moved[:, asked] += torch.where((lost | ended[going])[:, None], 0.0, step * size[going])
        x[going] = moved
        settled[going] |= done & ~lost & ~ended[going]
        ended[going] |= done | lost
        left = ~ended[going]
        if not bool(left.any()):
            break
        if 2 * int(left.sum()) < len(going):
            going = going[left]
            part = system[row[going]]
    return x, slopes, settled


def different(row: Tensor, place: Tensor, same_within: float = SAME) -> Tensor:
    """Which of the answers (c,) are not another one of their row again, (c,) bool. place: (c, a) in cells."""
    keep = torch.ones(len(row), dtype=torch.bool)
    order = torch.argsort(row, stable=True)
    there, at = row[order], place[order]
    for behind in range(1, len(row)):
        same = there[behind:] == there[:-behind]
        if not bool(same.any()):
            break
        near = same & ((at[behind:] - at[:-behind]).abs() <= same_within).all(-1)
        keep[order[behind:][near]] = False
    return keep


def stays(slopes: Tensor, free: Sequence[int]) -> Tensor:
    """Whether what is free to move, the inputs `free` among the first two, stays where it is: its tangent stiffness
    −∂y/∂x (slopes (c, 2, m)) is positive definite, (c,) bool. It is symmetric where the loads have a potential."""
    stiffness = -slopes[:, :, :2]
    if len(free) == 2:
        upright = (stiffness[:, 0, 0] > 0) & (stiffness[:, 1, 1] > 0)
        return upright & (stiffness[:, 0, 0] * stiffness[:, 1, 1] > stiffness[:, 0, 1] * stiffness[:, 1, 0])
    if len(free) == 1:
        return stiffness[:, free[0], free[0]] > 0
    return torch.ones(len(slopes), dtype=torch.bool)


def roots(
    system: System,
    start: tuple[Tensor, Tensor],
    asked: Sequence[int],
    given: Sequence[int],
    wanted: Tensor,
    size: Tensor,
    free: Sequence[int],
) -> Roots:
    """The different answers that Newton's method finds from starts: row (c,) and inputs (c, m).

    wanted: (N, a) of every row; size: of a cell, (N, a)."""
    row, x = start
    if not len(row):
        return Roots.none(x.shape[1])
    first = _settled(system, row, x, asked, given, wanted, size)
    row, x, slopes = _also(
        first, _partners(system, first, asked, given, size, free), system, asked, given, wanted, size
    )
    if not len(row):
        return Roots.none(x.shape[1])
    outputs, status = system[row].at(x)
    # A mount that snapped through, a tube that ballooned: numbers without a meaning are no answers.
    some = Roots(row, x, outputs, slopes, status, stays(slopes, free) & (status == Status.OK))
    return some[status != Status.NO_EQUILIBRIUM]


def _settled(
    system: System, row: Tensor, x: Tensor, asked: Sequence[int], given: Sequence[int], wanted: Tensor, size: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Rows, inputs and slopes of the different answers from starts."""
    x, slopes, settled = newton(system, row, x, asked, given, wanted[row], size[row])
    row, x, slopes = row[settled], x[settled], slopes[settled]
    new = different(row, x[:, list(asked)] / size[row])
    return row[new], x[new], slopes[new]


def _partners(
    system: System, found: Found, asked: Sequence[int], given: Sequence[int], size: Tensor, free: Sequence[int]
) -> tuple[Tensor, Tensor]:
    """Starts for the answers' partners: two branches meet where the determinant of the derivatives vanishes, and the
    other's answer lies about as far beyond, along the way in which an answer gives most, perhaps in the same cell. Of
    answers that would not stay, on either side besides."""
    row, x, slopes = found
    if not len(row) or len(asked) != 2:
        return row[:0], x[:0]
    asked, given = list(asked), list(given)
    unit = size[row]
    rate = slopes[:, given][:, :, asked] * unit[:, None, :]
    way = torch.linalg.svd(rate)[2][:, -1]

    def beside(cells: Tensor | float) -> Tensor:
        moved = x.clone()
        moved[:, asked] += cells * way * unit
        return moved

    part, each = system[row], []
    for side in (-ASIDE, ASIDE):
        _, there = part.slopes(beside(side))
        each.append(torch.linalg.det(there[:, given][:, :, asked] * unit[:, None, :]))
    beyond = -2 * torch.linalg.det(rate) * 2 * ASIDE / (each[1] - each[0])
    near = torch.nonzero(beyond.abs() <= LONGEST)[:, 0]
    gives = torch.nonzero(~stays(slopes, free))[:, 0]
    starts = [beside(beyond[:, None])[near], *(beside(side * far)[gives] for far in PARTNERS for side in (-1, 1))]
    return torch.cat([row[near], row[gives].repeat(2 * len(PARTNERS))]), torch.cat(starts)


def _also(
    found: Found,
    start: tuple[Tensor, Tensor],
    system: System,
    asked: Sequence[int],
    given: Sequence[int],
    wanted: Tensor,
    size: Tensor,
) -> Found:
    """With the different answers from further starts."""
    if not len(start[0]):
        return found
    more = _settled(system, *start, asked, given, wanted, size)
    row, x, slopes = (torch.cat(pair) for pair in zip(found, more, strict=True))
    new = different(row, x[:, list(asked)] / size[row])
    return row[new], x[new], slopes[new]
