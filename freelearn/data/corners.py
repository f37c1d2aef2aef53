"""Where a pressure that was read at the rows of a log turned between them.

An effect of the history follows straight lines from sample to sample. A valve's ramp or hold begins at a time of its
own, between two rows, and a lag of a fraction of their distance then feels a slope that no straight line has. Where the
pressure went straight before an interval and after it, both lines meet in it, and there the sample is that is lacking
(the subcell resolution of Harten, J. Comput. Phys. 83, 148, 1989).
"""

from __future__ import annotations

import numpy as np
import torch

from freelearn.data.recordings import Recording
from freelearn.data.states import States

# How far off the straight line a corner has to be, in standard deviations of the pressure's noise (of one, corners that
# the noise had moved let a dead time stand beside a warm gas); share of the turn by which two slopes on one side of it
# may differ: a curve bends by half of it.
OFF, STRAIGHT = 3.0, 0.25
# Share of the pressure's range that no noise is smaller than.
LEAST = 1e-6


def with_corners(states: States) -> States:
    """The same rows (N,) of a log, in whose recordings a sample more stands at each corner; other rows as they are."""
    if states.recording is None or states.place is None:
        return states
    recording = states.recording
    inputs = torch.stack(recording.states.inputs(), dim=1)
    within, turned = np.zeros(len(recording)), np.zeros((len(recording), inputs.shape[1]))
    for column in range(2, inputs.shape[1]):
        share, off = corners(inputs[:, column].numpy(), recording)
        # Of several pressures that turn in one interval the corner is that of the one that turns most.
        more = np.abs(off) > np.abs(turned).max(axis=1)
        within[more], turned[more] = share[more], 0.0
        turned[more, column] = off[more]
    later = np.flatnonzero(turned.any(axis=1))
    if not len(later):
        return states
    over = torch.as_tensor(within[later])
    # A new sample stands before the row that its interval ends with, and is a copy of that in all but what is imposed.
    rows = torch.as_tensor(np.insert(np.arange(len(recording)), later, later))
    new = torch.as_tensor(later + np.arange(len(later)))
    imposed, time = inputs[rows], recording.time[rows]
    straight = torch.lerp(inputs[later - 1], inputs[later], over[:, None])
    imposed[new] = straight + torch.as_tensor(turned[later])
    time[new] = torch.lerp(recording.time[later - 1], recording.time[later], over)
    finer = recording.states[rows].with_inputs(imposed.unbind(1))
    own = torch.ones(len(rows), dtype=torch.bool)
    own[new] = False
    place = torch.nonzero(own)[:, 0]
    return states.replace(recording=Recording(finer, recording.run[rows], time), place=place[states.place])


def corners(pressure: np.ndarray, recording: Recording[States]) -> tuple[np.ndarray, np.ndarray]:
    """Of the interval before each sample, the share of it that is over at its corner, and how far the pressure there is
    off the straight line [Pa]: zeros where there is none, (M,) each."""
    first, step = recording.first.numpy(), recording.step.numpy()
    slope = np.where(first, np.nan, np.diff(pressure, prepend=np.nan) / np.where(first, np.nan, step))
    before, after = _shifted(slope, 1), _shifted(slope, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = after - before
        share = (after - slope) / turn
        off = -share * (1 - share) * step * turn
        sides = np.abs(before - _shifted(slope, 2)), np.abs(after - _shifted(slope, -2))
        straight = np.fmin(*sides) < STRAIGHT * np.abs(turn)
        found = straight & (share > 0) & (share < 1) & (np.abs(off) > OFF * noise(pressure, slope, step))
    return np.where(found, share, 0.0), np.where(found, off, 0.0)


def noise(pressure: np.ndarray, slope: np.ndarray, step: np.ndarray) -> float:
    """Standard deviation of a pressure's noise, Pa, by the median of its second differences, most of which are those of
    straight lines."""
    second = np.abs(_shifted(slope, -1) - slope) * step
    least = LEAST * float(np.ptp(pressure))
    return max(float(np.nanmedian(second)) * 1.4826 / 6**0.5, least) if np.isfinite(second).any() else least


def _shifted(values: np.ndarray, by: int) -> np.ndarray:
    """The values of so many samples before, (M,); NaN where there is none. A slope of another recording is no neighbor:
    at a first sample it is NaN, and beyond."""
    found = np.full_like(values, np.nan)
    if by > 0:
        found[by:] = values[:-by]
    else:
        found[:by] = values[-by:]
    return found
