"""What of each row is asked for, whether the rest can tell it, and the nearest to it that can be reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import torch
from torch import Tensor

from freelearn.queries.inverse.system import System

# The nearest to what is wanted that can be reached, and of several ways to it that of the least pressures.

MAX_ITERATIONS = 15
# Steps shorter than this share of the box end the search.
TOLERANCE = 1e-10
# A step that takes away less than this share of the miss is the last.
STALL = 1e-4
# More inputs at once have too many faces of their box (3 to their number) to try them all.
MOST_ASKED = 6
# Weight of the pressures, in shares of the box, beside the misses in what they count in: it moves no answer by more
# than its square, but chooses among many.
LEAST = 1e-4
HALVINGS = 8


def nearest(
    system: System,
    x: Tensor,
    asked: Sequence[int],
    given: Sequence[int],
    wanted: Tensor,
    scale: Tensor,
    box: tuple[Tensor, Tensor],
    light: Sequence[int] = (),
) -> Tensor:
    """Inputs (N, m) of least Σ ((y − wanted)/scale)² within a box, from starts x (N, m); of several those with the
    least inputs `light`.

    given: the outputs that are wanted, (N, b); scale: what each counts in, (b,). box: least and largest
    inputs, (N, m) each. Gauss and Newton's method, each step a least-squares problem in the box, shortened until it
    helps.
    """
    asked, given = list(asked), list(given)
    low, high = box[0][:, asked], box[1][:, asked]
    size = (high - low).clamp_min(1e-300)
    weight = torch.tensor([LEAST if i in light else 0.0 for i in asked], dtype=x.dtype)
    x = x.clone()
    x[:, asked] = torch.minimum(torch.maximum(x[:, asked], low), high)
    going = torch.arange(len(x))
    for _ in range(MAX_ITERATIONS):
        if not len(going):
            break
        part, at = system[going], x[going]
        outputs, slopes = part.slopes(at)
        miss = (outputs[:, given] - wanted[going]) / scale
        rate = slopes[:, given][:, :, asked] * size[going][:, None, :] / scale[:, None]
        share = (at[:, asked] - low[going]) / size[going]
        rest = -low[going] / size[going]
        curvature = rate.transpose(1, 2) @ rate + torch.diag(weight**2)
        # Nothing turns on an input that no output feels: it stays.
        curvature = curvature + 1e-14 * curvature.diagonal(dim1=1, dim2=2).amax(-1).clamp_min(1e-30)[:, None, None] * (
            torch.eye(len(asked), dtype=x.dtype)
        )
        slope = (rate * miss[:, :, None]).sum(1) + weight**2 * (share - rest)
        step = _in_box(curvature, slope, -share, 1 - share)
        before = miss.square().sum(-1) + (weight * (share - rest)).square().sum(-1)
        # The longest of the step's halvings that helps, all tried at once where the whole step does not.
        moved, after, length = at.clone(), before.clone(), torch.zeros(len(going), dtype=x.dtype)
        for halvings in (torch.zeros(1, dtype=x.dtype), torch.arange(1.0, HALVINGS, dtype=x.dtype)):
            left = torch.nonzero(length == 0)[:, 0]
            each, tried = left.repeat_interleave(len(halvings)), torch.exp2(-halvings).repeat(len(left))
            trial = at[each]
            trial[:, asked] += tried[:, None] * step[each] * size[going[each]]
            now = (part[each].at(trial).loads[:, given] - wanted[going[each]]) / scale
            new = share[each] + tried[:, None] * step[each] - rest[each]
            value = now.square().sum(-1) + (weight * new).square().sum(-1)
            better = (value <= before[each]).reshape(-1, len(halvings))
            # Of each row the first that helps.
            first = torch.arange(len(left)) * len(halvings) + better.long().argmax(1)
            helps = better.any(1)
            for whole, some in ((moved, trial), (after, value), (length, tried)):
                whole[left[helps]] = some[first[helps]]
        x[going] = moved
        small = (length[:, None] * step).abs().amax(-1) <= TOLERANCE
        # At an answer the miss falls by orders of magnitude; where it hardly falls, the nearest is as good as found.
        stalls = before - after <= STALL * before
        going = going[~small & ~stalls]
    return x


def _in_box(curvature: Tensor, slope: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """Minimizers (N, k) of ½ xᵀ H x + gᵀ x in boxes: H (N, k, k) positive definite, g, low, high (N, k).

    Every face of the box is solved; the best of those whose solution lies in it is the minimum."""
    k = slope.shape[1]
    best = torch.full((len(slope),), torch.inf, dtype=slope.dtype)
    found = torch.minimum(torch.maximum(torch.zeros_like(slope), low), high)
    for face in product((None, low, high), repeat=k):
        x = torch.stack([torch.zeros_like(slope[:, i]) if f is None else f[:, i] for i, f in enumerate(face)], dim=-1)
        free = [i for i, f in enumerate(face) if f is None]
        if free:
            pull = slope[:, free] + (curvature[:, free] @ x[:, :, None])[..., 0]
            x[:, free] = torch.linalg.solve(curvature[:, free][:, :, free], -pull[..., None])[..., 0]
        value = 0.5 * (x[:, None, :] @ curvature @ x[:, :, None])[:, 0, 0] + (slope * x).sum(-1)
        inside = ((x >= low - 1e-12) & (x <= high + 1e-12)).all(-1) & (value < best)
        best = torch.where(inside, value, best)
        found = torch.where(inside[:, None], x, found)
    return torch.minimum(torch.maximum(found, low), high)


# What of each row is asked for, and whether the rest can tell it.


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
