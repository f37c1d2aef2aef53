"""Which of several solutions an actuator takes that is moved from rest little by little."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.blanks import Pattern
from freelearn.queries.inverse.roots import Equations, Roots
from freelearn.queries.inverse.system import Span, System

# Where an actuator comes to rest that is taken from rest to its loads and pressures little by little.

STEPS = 16
# The way need not be known better than the branches lie apart: in what a cell is for Newton's method; and its steps.
ROUGHLY, MOST = 1e-2, 8


def path_end(system: System, x: Tensor, asked: Sequence[int], given: Sequence[int], wanted: Tensor) -> Tensor:
    """Inputs (N, m) at the end of the path along which all that is given grows from rest in proportion.

    x: inputs given (N, m), of which those asked for do not matter; wanted: the outputs given, (N, a). Each step starts
    at the last answer; where a branch ends, the last answer on it stays.
    """
    rest = torch.zeros_like(x)
    if system.mechanical:
        rest[:, 0] = system.states.reference_length
    asked = list(asked)
    goal = x.clone()
    goal[:, asked] = rest[:, asked]
    at = rest.clone()
    size = torch.stack(
        [0.05 * system.states.reference_length if i == 0 else torch.full((len(x),), 0.3, dtype=x.dtype) for i in asked],
        dim=-1,
    )
    row = torch.arange(len(x))
    for k in range(1, STEPS + 1):
        share = k / STEPS
        here = rest + share * (goal - rest)
        here[:, asked] = at[:, asked]
        moved, _, settled = Equations(system, asked, given, share * wanted, size).newton(row, here, ROUGHLY, MOST)
        at = torch.where(settled[:, None], moved, at)
    return at


# Which of several solutions an actuator takes.

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
