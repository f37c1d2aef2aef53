"""The nearest to what is wanted that can be reached, and of several ways to it that of the least pressures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import torch
from torch import Tensor

from freelearn.answer.system import System

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
