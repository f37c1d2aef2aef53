"""Where an actuator comes to rest that is taken from rest to its loads and pressures little by little."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from freelearn.answer.roots import Equations
from freelearn.answer.system import System

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
