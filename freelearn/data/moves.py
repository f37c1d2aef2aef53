"""From which side the bed came to a state."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.data.states import States

# Moves as a share of the length at rest, and in radians, that count whole, and less in proportion: a stage jitters.
ALONG, AROUND = 2e-4, 5e-3


def moved_by(states: States) -> Tensor:
    """Signs of the last move of the length and of the twist, (N, 2): ±1, 0 where there was none."""
    moves = torch.stack([states.moved_length / (ALONG * states.reference_length), states.moved_twist / AROUND], dim=-1)
    return moves.clamp(-1.0, 1.0)


def driven(states: States) -> Tensor:
    """Rows that a move led to, the pressure held since, (N,) bool: of sweeps under one pressure all."""
    return (states.direction == 0) & (moved_by(states).abs().amax(-1) > 0.5)


def swept(states: States) -> bool:
    """Whether most rows are such: under one pressure the place is driven. Along a log the history knows better."""
    return states.recording is None and not states.members and bool(driven(states).double().mean() > 0.5)
