"""Newton's method from many starts at once, and the different answers that it finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.row_derivatives import divide
from freelearn.queries.inverse.system import System

MAX_ITERATIONS = 15
# A last Newton step this small, in cells of the grid or in what counts as one, leaves an error of about its square.
TOLERANCE = 1e-7
# Longest step in cells; answers nearer to each other than this many cells are one.
LONGEST, SAME = 2.0, 1e-4
# A start that has strayed so many cells out of what is looked through is given up.
STRAYED = 2.0
# How far from an answer that gives way its partner is looked for, in cells.
PARTNERS = (0.1, 0.4, 1.2)
# So far beside an answer, in cells, it is seen how the derivatives change.
ASIDE = 0.05


# Rows, inputs, and the outputs' derivatives of some answers.
Places = tuple[Tensor, Tensor, Tensor]


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


@dataclass(frozen=True)
class Equations:
    """What is to be solved. system: of N rows. asked: places of the inputs to find; given: of as many outputs, which
    have to be as wanted (N, a). size: of a cell of the grid along each input asked for, (N, a). box: least and largest
    value of each of these, (N, a) twice; None for no limit."""

    system: System
    asked: Sequence[int]
    given: Sequence[int]
    wanted: Tensor
    size: Tensor
    box: tuple[Tensor, Tensor] | None = None

    def by_asked(self, row: Tensor, slopes: Tensor) -> Tensor:
        """Of the outputs' derivatives (c, 2, m) those that count, for a cell each, (c, a, a)."""
        return slopes[:, list(self.given)][:, :, list(self.asked)] * self.size[row][:, None, :]

    def cells(self, row: Tensor, x: Tensor) -> Tensor:
        """Places x (c, m) in cells, (c, a)."""
        return x[:, list(self.asked)] / self.size[row]

    def strayed(self, row: Tensor, x: Tensor) -> Tensor:
        """Which places x (c, m) are too far out of the box to come back, (c,) bool."""
        if self.box is None:
            return torch.zeros(len(x), dtype=torch.bool)
        at, room = x[:, list(self.asked)], STRAYED * self.size[row]
        return ((at < self.box[0][row] - room) | (at > self.box[1][row] + room)).any(-1)

    def newton(
        self, row: Tensor, x: Tensor, tolerance: float = TOLERANCE, most: int = MAX_ITERATIONS
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Inputs (c, m) that solve rows (c,), from starts x (c, m); outputs' derivatives (c, 2, m) at the last place
        looked at; and which have settled, (c,) bool.

        With one last step after the derivatives were taken, the error is about the square of the tolerance.
        """
        given, asked = list(self.given), list(self.asked)
        x, settled = x.clone(), torch.zeros(len(x), dtype=torch.bool)
        slopes = torch.full((len(x), 2, x.shape[1]), torch.nan, dtype=x.dtype)
        # Rows that are worked on; picked anew only when half of them have come to their end: picking costs as much.
        going, ended = torch.arange(len(x)), torch.zeros(len(x), dtype=torch.bool)
        part = self.system[row]
        for _ in range(most):
            here = row[going]
            outputs, rate = part.slopes(x[going])
            slopes[going] = torch.where(ended[going][:, None, None], slopes[going], rate)
            miss, by_asked = outputs[:, given] - self.wanted[here], self.by_asked(here, rate)
            step = -miss / by_asked[:, 0] if len(asked) == 1 else -divide(miss, by_asked)
            lost = ~step.isfinite().all(-1)
            done = (step.abs() <= tolerance).all(-1)
            # All of a step is shortened, so that it keeps its direction.
            longest = step.abs().amax(-1, keepdim=True)
            step = step * torch.clamp(LONGEST / longest, max=1.0)
            moved = x[going]
            moved[:, asked] += torch.where((lost | ended[going])[:, None], 0.0, step * self.size[here])
            x[going] = moved
            settled[going] |= done & ~lost & ~ended[going]
            ended[going] |= done | lost | self.strayed(here, moved)
            left = ~ended[going]
            if not bool(left.any()):
                break
            if 2 * int(left.sum()) < len(going):
                going = going[left]
                part = self.system[row[going]]
        return x, slopes, settled

    def roots(self, row: Tensor, x: Tensor, free: Sequence[int]) -> Roots:
        """The different answers that Newton's method finds from starts x (c, m) of rows (c,). free: what of length and
        twist nothing holds."""
        if not len(row):
            return Roots.none(x.shape[1])
        first = self._settled(row, x)
        row, x, slopes = self._also(first, self._partners(first, free))
        if not len(row):
            return Roots.none(x.shape[1])
        outputs, status = self.system[row].at(x)
        # A mount that snapped through, a tube that ballooned: numbers without a meaning are no answers.
        some = Roots(row, x, outputs, slopes, status, stays(slopes, free) & (status == Status.OK))
        return some[status != Status.NO_EQUILIBRIUM]

    def _settled(self, row: Tensor, x: Tensor) -> Places:
        """The different answers from starts."""
        x, slopes, settled = self.newton(row, x)
        return self._once(row[settled], x[settled], slopes[settled])

    def _once(self, row: Tensor, x: Tensor, slopes: Tensor) -> Places:
        new = different(row, self.cells(row, x))
        return row[new], x[new], slopes[new]

    def _partners(self, found: Places, free: Sequence[int]) -> tuple[Tensor, Tensor]:
        """Starts for the answers' partners: two branches meet where the determinant of the derivatives vanishes, and
        the other's answer lies about as far beyond, along the way in which an answer gives most, perhaps in the same
        cell. Of answers that would not stay, on either side besides."""
        row, x, slopes = found
        if not len(row) or len(self.asked) != 2:
            return row[:0], x[:0]
        rate = self.by_asked(row, slopes)
        way = torch.linalg.svd(rate)[2][:, -1] * self.size[row]

        def beside(cells: Tensor | float) -> Tensor:
            moved = x.clone()
            moved[:, list(self.asked)] += cells * way
            return moved

        part = self.system[row]
        each = [torch.linalg.det(self.by_asked(row, part.slopes(beside(side))[1])) for side in (-ASIDE, ASIDE)]
        beyond = -2 * torch.linalg.det(rate) * 2 * ASIDE / (each[1] - each[0])
        near = torch.nonzero(beyond.abs() <= LONGEST)[:, 0]
        gives = torch.nonzero(~stays(slopes, free))[:, 0]
        starts = [beside(beyond[:, None])[near], *(beside(side * far)[gives] for far in PARTNERS for side in (-1, 1))]
        return torch.cat([row[near], row[gives].repeat(2 * len(PARTNERS))]), torch.cat(starts)

    def _also(self, found: Places, start: tuple[Tensor, Tensor]) -> Places:
        """With the different answers from further starts."""
        if not len(start[0]):
            return found
        return self._once(*(torch.cat(pair) for pair in zip(found, self._settled(*start), strict=True)))


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
