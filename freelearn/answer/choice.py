"""Which of several solutions an actuator takes."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.answer.blanks import Pattern
from freelearn.answer.path import path_end
from freelearn.answer.roots import Roots
from freelearn.answer.span import Span
from freelearn.answer.system import System
from freelearn.models.prediction import Status

# What being unstable, and being no equilibrium at all, counts beside a distance in shares of the span looked through.
UNSTABLE, NONE = 1e6, 1e9


def chosen(span: Span, system: System, pattern: Pattern, x: Tensor, y: Tensor, some: Roots) -> tuple[Tensor, Tensor]:
    """The root that each row's actuator takes, its place among some or −1, and how many there are: (N,) each."""
    n = len(x)
    count = torch.zeros(n, dtype=torch.int64).index_add_(0, some.row, torch.ones_like(some.row))
    # Stable ones first, then the least pressures, then those nearest to where the path from rest ends.
    far = torch.zeros(len(some), dtype=torch.float64)
    pressures = [i for i in pattern.asked if i >= 2]
    if pressures:
        far = (some.x[:, pressures] / (span.looked[1] - span.looked[0])[pressures]).square().sum(-1)
    else:
        stable = torch.zeros(n, dtype=torch.int64).index_add_(0, some.row, some.stable.long())
        several = torch.nonzero(stable > 1)[:, 0]
        if len(several):
            asked, given = list(pattern.asked), list(pattern.given)
            low, high = span.box(system)
            at = torch.full((n, len(asked)), torch.nan, dtype=torch.float64)
            at[several] = path_end(system[several], x[several], asked, given, y[several][:, given])[:, asked]
            gap = ((some.x[:, asked] - at[some.row]) / (high - low)[some.row][:, asked]).square().sum(-1)
            far = gap.nan_to_num(0.0)
    order = far + torch.where(some.stable, 0.0, UNSTABLE) + torch.where(some.status == Status.OK, 0.0, NONE)
    best = torch.full((n,), torch.inf, dtype=torch.float64).scatter_reduce(0, some.row, order, "amin")
    taken = torch.full((n,), -1, dtype=torch.int64)
    first = torch.nonzero(order == best[some.row])[:, 0].flip(0)
    taken[some.row[first]] = first
    return taken, count
