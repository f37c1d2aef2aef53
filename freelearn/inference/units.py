"""What of a table's rows counts as independent of the others."""

from __future__ import annotations

import torch
from torch import Tensor

# Fewest units: of their signs there are 2²⁴ patterns.
FEWEST_UNITS = 24


def units(state: Tensor, states: int) -> tuple[Tensor, int]:
    """The unit of each row, (N,) int64, and how many there are: what a bootstrap flips and a paired test compares.

    Kinematic states, numbered 0 … states − 1. Of fewer than FEWEST_UNITS hardly any two patterns of signs differ, and
    no effect could be told from chance (Cameron, Gelbach & Miller 2008, Section IV): each state is cut into runs of
    rows, in the order of measuring. The position error that a state's rows share is whitened away already; that an
    effect carries over to other states is for cross-validation to say, which still leaves out whole states.

    >>> units(torch.tensor([0, 0, 0, 0, 1, 1, 1, 1]), 2)[1]
    8
    """
    if states >= FEWEST_UNITS:
        return state, states
    runs = -(-FEWEST_UNITS // max(states, 1))
    unit = torch.empty_like(state)
    count = 0
    for number in range(states):
        rows = torch.nonzero(state == number)[:, 0]
        pieces = min(runs, len(rows))
        unit[rows] = count + torch.arange(len(rows)) * pieces // max(len(rows), 1)
        count += pieces
    return unit, count
