"""Where between the nodes of a grid the outputs may have the values that are wanted."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.queries.inverse.nodes import Nodes

# A cell is looked into if it would hold the values, were its outputs to vary by this share more than at its corners.
MORE = 0.15
# Newton steps inside a cell, and how far beyond it (in cells) a start may lie.
STEPS, BEYOND = 4, 0.3


def starts(nodes: Nodes, wanted: Tensor, thorough: bool = False) -> tuple[Tensor, Tensor]:
    """Row (c,) and place (c, a) of every start. wanted: values (N, a) of as many outputs as inputs are asked for.

    nodes.outputs: of these outputs alone, (N, n₁, …, a), NaN where there are none. thorough: whether there is a start
    too in the middle of every cell that may hold the values, or of which only some corners have outputs: where these
    bend sharply, or end, the corners do not tell."""
    miss = nodes.outputs - wanted.reshape(len(wanted), *[1] * len(nodes.axes), -1)
    row, place = _along(nodes, miss[..., 0]) if len(nodes.axes) == 1 else _across(nodes, miss)
    if not thorough:
        return row, place
    cells = _at_edges(miss)
    if len(nodes.axes) == 2:
        cells = torch.cat([cells, _holding(miss)])
    at = cells[:, 0]
    middles = [(axis[at, i] + axis[at, i + 1]) / 2 for axis, i in zip(nodes.axes, cells[:, 1:].unbind(1), strict=True)]
    return torch.cat([row, at]), torch.cat([place, torch.stack(middles, dim=-1)])


def _at_edges(miss: Tensor) -> Tensor:
    """Row and place (c, 1 + a) of the cells of which some corners have outputs and some have none."""
    every = some = miss.isfinite().all(-1)
    for k in range(1, miss.ndim - 1):
        count = every.shape[k] - 1
        every = every.narrow(k, 0, count) & every.narrow(k, 1, count)
        some = some.narrow(k, 0, count) | some.narrow(k, 1, count)
    return torch.nonzero(some & ~every)


def _along(nodes: Nodes, miss: Tensor) -> tuple[Tensor, Tensor]:
    left, right = miss[:, :-1], miss[:, 1:]
    room = MORE * (right - left).abs()
    inside = (torch.minimum(left, right) <= room) & (torch.maximum(left, right) >= -room)
    row, cell = torch.nonzero(inside, as_tuple=True)
    a, b = left[row, cell], right[row, cell]
    share = (-a / torch.where(a == b, 1.0, b - a)).clamp(-BEYOND, 1 + BEYOND)
    axis = nodes.axes[0]
    return row, torch.lerp(axis[row, cell], axis[row, cell + 1], share)[:, None]


def _across(nodes: Nodes, miss: Tensor) -> tuple[Tensor, Tensor]:
    row, i, j = _holding(miss).unbind(1)
    corners = torch.stack([miss[row, i, j], miss[row, i + 1, j], miss[row, i, j + 1], miss[row, i + 1, j + 1]])
    place, found = _bilinear(corners)
    row, i, j, place = row[found], i[found], j[found], place[found]
    at = [
        torch.lerp(axis[row, k], axis[row, k + 1], place[:, n])
        for n, (axis, k) in enumerate(zip(nodes.axes, (i, j), strict=True))
    ]
    return row, torch.stack(at, dim=-1)


def _holding(miss: Tensor) -> Tensor:
    """Row and place (c, 3) of the cells that may hold a zero of both channels of miss (n, n₁, n₂, 2)."""
    inside = None
    for channel in miss.unbind(-1):
        across = torch.minimum(channel[:, :-1], channel[:, 1:]), torch.maximum(channel[:, :-1], channel[:, 1:])
        low, high = (
            torch.minimum(across[0][..., :-1], across[0][..., 1:]),
            torch.maximum(across[1][..., :-1], across[1][..., 1:]),
        )
        room = MORE * (high - low)
        holds = (low <= room) & (high >= -room)
        inside = holds if inside is None else inside & holds
    assert inside is not None
    return torch.nonzero(inside)


def _bilinear(corners: Tensor) -> tuple[Tensor, Tensor]:
    """Place (c, 2) in its cell at which the bilinear function of corners (4, c, 2) vanishes, and whether it does near
    the cell, (c,) bool."""
    first, right, up, both = corners
    by_s, by_t, mixed = right - first, up - first, both - right - up + first
    place = torch.full((first.shape[0], 2), 0.5, dtype=first.dtype)
    for _ in range(STEPS):
        s, t = place[:, :1], place[:, 1:]
        value = first + s * by_s + t * by_t + s * t * mixed
        ds, dt = by_s + t * mixed, by_t + s * mixed
        det = ds[:, 0] * dt[:, 1] - ds[:, 1] * dt[:, 0]
        step = (
            torch.stack(
                [dt[:, 1] * value[:, 0] - dt[:, 0] * value[:, 1], ds[:, 0] * value[:, 1] - ds[:, 1] * value[:, 0]],
                dim=-1,
            )
            / torch.where(det == 0, 1.0, det)[:, None]
        )
        place = (place - step.clamp(-1, 1)).clamp(-1, 2)
    near = ((place >= -BEYOND) & (place <= 1 + BEYOND)).all(-1)
    return place, near
