"""What is expected of one sample's residuals: what the model absorbs, smooth shapes, its states' position errors."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.discovery.noise.memory import Filter
from freelearn.discovery.noise.shapes import both_loads, generic

# Readings of a sample beyond which no single one has leverage worth computing.
LEVERAGED = 1800
# Precision of what the model absorbs: next to nothing is known beforehand.
FREE = 1e-10
# Variance of a shape's coefficient to begin with, in units of the residuals' own, and the range it stays in.
BROAD, LEAST, MOST = 1.0, 1e-6, 1e12
# Share of the largest below which a column of what the model absorbs is one of the others once more.
SAME = 1e-9


@dataclass(frozen=True)
class Part:
    """error (n, 2): residuals less what is expected without the reading itself; spread (n, 2): variance of that
    expectation; expected (n, 2). N, N·m (squared). moved (states,): squared length of each state's position error, in
    units of its standard deviations, uncertainty included."""

    error: Tensor
    spread: Tensor
    expected: Tensor
    moved: Tensor


class Smooth:
    """One sample's rows (n,) and all that may be expected of their residuals (n, 2)."""

    def __init__(
        self,
        rows: Tensor,
        residual: Tensor,
        jacobian: Tensor,
        noise: Tensor,
        positions: Tensor,
        states: States,
        state: Tensor,
        told: Tensor,
    ) -> None:
        """noise (n, 2): standard deviations as stated; positions (n, 2, 2): loads of one such position error; told
        (n, 2) bool: readings that there are, and that are not censored."""
        self.rows, self.residual, self.positions = rows, residual, positions
        _, self.state = torch.unique(state, return_inverse=True)
        self.states = int(self.state.max()) + 1
        shapes, kind = generic(states, self.states)
        unit = noise.square().mean(0).sqrt()
        size = shapes.square().mean(0).sqrt()
        shapes, kind = shapes[:, size > 1e-9] / size[size > 1e-9], kind[size > 1e-9]
        own = _span(jacobian) * unit.mean()
        self.columns = torch.cat([both_loads(shapes * unit[0], shapes * unit[1]), own], dim=2)
        kinds = int(kind.max()) + 1
        self.group = torch.cat([kind, kind + kinds, torch.full((own.shape[2],), -1)])
        some = (residual / noise)[told]
        scatter = some.abs().median().clamp_min(1.0) ** 2 if len(some) else 1.0
        self.variance = torch.full((2 * kinds,), BROAD * float(scatter), dtype=torch.float64)

    def expected(
        self, base: Tensor, weight: Tensor, position: float, precision: Tensor, forget: Filter | None = None
    ) -> Part:
        """base (n, 2): standard deviation of a good reading; weight (n, 2): precision of each in units of that.
        position, precision (n,): scale of position errors, and their states' precision in units of that. forget: of
        errors that have a memory.

        The variances of the shapes are brought up to date."""
        root = weight.clamp_min(1e-12).sqrt() / base
        columns = self.columns * root[:, :, None]
        moves = self.positions * (position / precision.sqrt())[:, None, None] * root[:, :, None]
        target = self.residual * root
        seen, felt = columns, moves
        if forget is not None:
            columns, moves = forget.innovations(columns), forget.innovations(moves)
            target = forget.innovations(target[..., None])[..., 0]
        inner = torch.linalg.inv(torch.eye(2, dtype=torch.float64) + self._sum(moves.transpose(1, 2) @ moves))
        # What states' positions take, out of inner products of columns and target: (states, 2, …).
        along = torch.stack([self._sum((columns * moves[:, :, j, None]).sum(1)) for j in (0, 1)], dim=1)
        pulled = self._sum((moves * target[..., None]).sum(1))
        taken = inner @ along
        flat = columns.flatten(0, 1)
        prior = torch.where(self.group < 0, FREE, 1 / self.variance[self.group.clamp_min(0)])
        gram = flat.T @ flat - along.flatten(0, 1).T @ taken.flatten(0, 1)
        inverse = torch.linalg.inv(gram + torch.diag(prior))
        inverse = (inverse + inverse.T) / 2
        slope = inverse @ (flat.T @ target.reshape(-1) - taken.flatten(0, 1).T @ pulled.reshape(-1))
        self._bring_up_to_date(slope, inverse)
        move = (inner @ (pulled - along @ slope)[..., None])[..., 0]
        expected = (seen @ slope + (felt @ move[self.state][..., None])[..., 0]) / root
        own = (felt @ inner[self.state] * felt).sum(-1)
        if len(flat) <= LEVERAGED:
            left = (seen - felt @ taken[self.state]).flatten(0, 1)
            own = own + ((left @ inverse) * left).sum(1).reshape(-1, 2)
        share = own.clamp(0, 1 - 1e-6)
        spread = own / root**2 / (1 - share)
        moved = move.square().sum(1) + inner.diagonal(dim1=1, dim2=2).sum(1)
        # The precision of its state is no part of how far it moved.
        first = torch.zeros(self.states, dtype=torch.float64).index_copy_(0, self.state, precision)
        return Part((self.residual - expected) / (1 - share), spread, expected, moved / first)

    def _bring_up_to_date(self, slope: Tensor, inverse: Tensor) -> None:
        """MacKay's (1992) fixed point: a group's variance is its squared coefficients over how many of them the data
        decide."""
        shapes = self.group >= 0
        group = self.group[shapes]

        def total(each: Tensor) -> Tensor:
            return torch.zeros_like(self.variance).index_add_(0, group, each)

        decided = total(1 - inverse.diagonal()[shapes] / self.variance[group])
        self.variance = (total(slope[shapes].square()) / decided.clamp_min(1e-3)).clamp(LEAST, MOST)

    def _sum(self, rows: Tensor) -> Tensor:
        return torch.zeros(self.states, *rows.shape[1:], dtype=rows.dtype).index_add_(0, self.state, rows)


def _span(jacobian: Tensor) -> Tensor:
    """Independent columns (n, 2, r ≤ p) of unit mean square that span those of a Jacobian (n, 2, p).

    Of two parameters that move the loads alike, together with next to no prior, no precision could be inverted."""
    flat = jacobian.flatten(0, 1)
    flat = flat / flat.square().mean(0).sqrt().clamp_min(1e-300)
    basis, size = torch.linalg.svd(flat, full_matrices=False)[:2]
    kept: Tensor = basis[:, size > SAME * size[:1]] * len(flat) ** 0.5
    return kept.reshape(*jacobian.shape[:2], -1)
