"""Shapes that a missing history may leave in a log: what is imposed, late by several times and held back by plays."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.measurements.recording import Recording
from freelearn.measurements.scans import stopped
from freelearn.measurements.states import States
from freelearn.models.lags import lag

# Times of lags from the usual step from row to row to this share of the longest recording.
LAGS, SHORTEST, LONGEST = 5, 0.5, 0.3
# Half widths of plays, of the range of what is imposed.
PLAYS = (0.02, 0.1, 0.4)
# A quantity that changes by less than this share of its size within every recording stays as it is.
STILL = 1e-6


def history(states: States) -> Tensor:
    """Columns (N, k) of rows of a log; none of another table.

    By how much each quantity imposed is ahead of its lag, for several times, and what plays hold back of it, these also
    in proportion to what is imposed.
    """
    if states.recording is None or states.place is None:
        return torch.zeros(len(states), 0, dtype=torch.float64)
    recording, place = states.recording.around(states.place)
    inputs = torch.stack([_scaled(x) for x in recording.states.inputs()], dim=1)
    moving = inputs[:, recording.change(inputs).abs().amax(0) > STILL]
    times = _times(recording)
    late = [lag(moving, recording, moving.new_tensor(t)) for t in times]
    free = ~recording.first[:, None]
    held = [stopped(moving, *(torch.where(free, sign * w, 0.0).expand_as(moving) for sign in (-1, 1))) for w in PLAYS]
    # A play's width may depend on where the actuator is.
    each = torch.cat([*late, *held], dim=1)
    sloped = torch.cat(held, dim=1)
    varied = [sloped * x[:, None] for x in inputs.unbind(1)]
    columns: Tensor = torch.cat([each, *varied], dim=1)[place]
    return columns


def _scaled(x: Tensor) -> Tensor:
    """x (N,) moved and stretched to [0, 1]; zeros where all values are the same."""
    wide = x.max() - x.min()
    return (x - x.min()) / wide if float(wide) > 0 else torch.zeros_like(x)


def _times(recording: Recording[States]) -> list[float]:
    begun, ended = recording.ends
    longest = float((recording.time[ended] - recording.time[begun]).max())
    steps = recording.step[recording.step > 0]
    shortest = SHORTEST * float(steps.median()) if len(steps) else 1.0
    return torch.logspace(0, 1, LAGS, base=max(LONGEST * longest / shortest, 1.0)).mul(shortest).tolist()
