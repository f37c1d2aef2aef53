"""Where a pressure, a length or a twist that was read at the rows of a log turned between them.

An effect of the history follows straight lines from sample to sample. A valve's ramp or hold begins at a time of its
own, between two rows, and a lag of a fraction of their distance then feels a slope that no straight line has. Where the
pressure went straight before an interval and after it, both lines meet in it, and there the sample is that is lacking
(the subcell resolution of Harten, J. Comput. Phys. 83, 148, 1989). Where it goes along a curve, samples stand on that
(see curves).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from freelearn.data.calm import Calm
from freelearn.data.curves import MAD, between, flicker, pieces, smooth
from freelearn.data.recordings import Recording
from freelearn.data.states import States

# How far off the straight line a corner has to be, in standard deviations of the pressure's noise (of one, corners that
# the noise had moved let a dead time stand beside a warm gas); share of the turn by which two slopes on one side of it
# may differ: a curve bends by half of it.
OFF, STRAIGHT = 3.0, 0.25
# Share of the pressure's range that no noise is smaller than.
LEAST = 1e-6
# Fewest steps between the values of a signal by which it may have been rounded, by how much of the least one each may
# be no whole number of these, and of how many most are less: values that a bed was set to are no such steps.
LEVELS, WHOLE, NEXT = 8, 0.02, 3.0
# Share of a signal's size that two readings differ by which are the same.
SAME = 1e-9
# A change beyond so many standard deviations of the noise is one; and how many of the slope's may pass for straight.
CHANGED, LIKE = 8.0, 4.0
# Pieces of a straight line, from row to row or to a corner, that tell where it begins, its slope and where it ends.
PIECES = 3
# Shares of a log's rows below which the noise's heavy tails bear such rows, and beyond which nothing is left without.
FEW, MOST = 0.1, 0.4
# Share of the moves that the rows tell which ends between two of them where nothing ties moves to the rows.
SYNCHRONOUS = 0.25


def with_corners(states: States) -> States:
    """The same rows (N,) of a log, in whose recordings a sample more stands at each corner, and some along each curve;
    other rows as they are."""
    return _with_more(states, along_curves=True)


def _with_more(states: States, along_curves: bool) -> States:
    if states.recording is None or states.place is None:
        return states
    recording = states.recording
    assert recording.turns is None, "the corners of a log are put into it once"
    inputs = torch.stack(recording.states.inputs(), dim=1).numpy()
    within, turned, most = np.zeros(len(recording)), np.zeros(inputs.shape), np.zeros(len(recording))
    cut = np.ones(inputs.shape, dtype=np.int64)
    for column, signal in enumerate(inputs.T):
        error = _flicker(signal, recording)
        along = smooth(signal, recording, error)
        share, off = corners(signal, recording, along)
        # Of several that turn in one interval the corner is that of the one that turns most, of its range.
        size = np.abs(off) / max(float(np.ptp(signal)), 1e-300)
        more = size > most
        most[more], within[more], turned[more] = size[more], share[more], 0.0
        turned[more, column] = off[more]
        if along_curves:
            cut[:, column] = pieces(signal, recording, along, error)
    cornered = (turned != 0).any(axis=1)
    number = np.where(cornered, 2, cut.max(axis=1))
    # Of each new sample: the row that its interval ends with, and the share of that which is over.
    later = np.repeat(np.arange(len(recording)), number - 1)
    if not len(later):
        return states
    begun = np.cumsum(number - 1) - (number - 1)
    over = (np.arange(len(later)) - begun[later] + 1) / number[later]
    over[cornered[later]] = within[cornered]
    imposed = inputs[later - 1] + over[:, None] * (inputs[later] - inputs[later - 1]) + turned[later]
    for column, signal in enumerate(inputs.T):
        curved = ~cornered[later] & (cut[later, column] > 1)
        imposed[curved, column] = between(signal, recording, later[curved], over[curved])
    return _inserted(states, recording, later, over, imposed)


def _inserted(
    states: States, recording: Recording[States], later: np.ndarray, over: np.ndarray, new: np.ndarray
) -> States:
    """The rows with more samples in their recording: each before the row later (n,), where a share over (n,) of its
    interval is over, a copy of that row in all but what is imposed, new (n, i)."""
    rows = torch.as_tensor(np.insert(np.arange(len(recording)), later, later))
    turns = torch.zeros(len(rows), dtype=torch.bool)
    turns[later + np.arange(len(later))] = True
    imposed, time = torch.stack(recording.states.inputs(), dim=1)[rows], recording.time[rows]
    imposed[turns] = torch.as_tensor(new)
    time[turns] = torch.lerp(recording.time[later - 1], recording.time[later], torch.as_tensor(over))
    finer = recording.states[rows].with_inputs(imposed.unbind(1))
    place = torch.nonzero(~turns)[:, 0]
    assert states.place is not None
    return states.replace(recording=Recording(finer, recording.run[rows], time, turns), place=place[states.place])


def with_calm(states: States) -> States:
    """The same rows (N,) of a log, whose recordings tell what of their samples a gauge flickers; other rows as they
    are."""
    if states.recording is None:
        return states
    recording = states.recording
    inputs, begins = torch.stack(recording.states.inputs(), dim=1).numpy(), recording.first.clone()
    own = np.ones(len(recording), dtype=bool)
    if recording.turns is not None:
        # At a turn between rows one line ends and another begins.
        begins |= recording.turns
        begins[1:] |= recording.turns[:-1]
        own = ~recording.turns.numpy()
    rows = recording[torch.as_tensor(np.flatnonzero(own))]
    noises = [_flicker(signal[own], rows) for signal in inputs.T]
    calm = Calm.of_inputs(recording.time.numpy(), begins.cumsum(0).numpy(), inputs, noises)
    return states.replace(recording=replace(recording, calm=calm))


def corners(signal: np.ndarray, recording: Recording[States], along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the interval before each sample, the share of it that is over at its corner, and how far the signal there is
    off the straight line: zeros where there is none, (M,) each. along: rows about which the signal is smooth."""
    slope, step = _slopes(signal, recording), recording.step.numpy()
    before, after = _shifted(slope, 1), _shifted(slope, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = after - before
        share = (after - slope) / turn
        off = -share * (1 - share) * step * turn
        sides = np.abs(before - _shifted(slope, 2)), np.abs(after - _shifted(slope, -2))
        straight = np.fmin(*sides) < STRAIGHT * np.abs(turn)
        straight[1:] &= ~(along[1:] & along[:-1])
        found = straight & (share > 0) & (share < 1) & (np.abs(off) > OFF * noise(signal, slope, step))
    return np.where(found, share, 0.0), np.where(found, off, 0.0)


def untold(states: States) -> np.ndarray:
    """Rows of a log before which something imposed went from one row to the next on a way that the rows do not tell,
    (N,) bool. What is quicker than a row feels that way, and is off by as much as it does there. None where these are
    few, where a log is all like that, or the table is none.

    A move has a beginning, a rate and an end: three numbers, which three of its pieces tell, those up to a corner that
    was found included. Of fewer the bed may have gone faster, and stood still for the rest; unless it begins and ends
    at rows where it is seen to. A log is one by all its rows, whichever of them these are. states: with_corners."""
    if states.recording is None or states.place is None:
        return np.zeros(len(states), dtype=bool)
    if states.recording.turns is not None:
        # What stands along curves has no beginning and no end.
        states = _with_more(_rows_alone(states), along_curves=False)
    assert states.recording is not None
    assert states.place is not None
    recording = states.recording
    first, step = recording.first.numpy(), recording.step.numpy()
    found = np.zeros(len(recording), dtype=bool)
    between = np.zeros(len(recording), dtype=bool) if recording.turns is None else recording.turns.numpy()
    for signal in recording.states.inputs():
        value = signal.numpy()
        slope = _slopes(value, recording)
        flicker = noise(value, slope, step)
        # Slopes of short pieces are known less.
        near = STRAIGHT * np.abs(slope) + LIKE * flicker / np.where(first, np.nan, step)
        on = np.abs(slope - _shifted(slope, 1)) < np.fmax(near, _shifted(near, 1))
        line = np.cumsum(~on)
        moved = np.abs(slope * step) > CHANGED * flicker
        # A corner within the noise of a row tells nothing of where it is.
        told = moved & (np.bincount(line, moved)[line] >= PIECES)
        ends = np.flatnonzero(told & (np.append(line[1:], -1) != line))
        if len(ends) and between[ends].mean() > SYNCHRONOUS:
            found |= moved & ~told
    share = found[~between].mean()
    dark: np.ndarray = found[states.place.numpy()]
    return dark if FEW < share < MOST else np.zeros_like(dark)


def _rows_alone(states: States) -> States:
    """The same rows of a log, in whose recordings no sample stands that is no row of the table."""
    recording, place = states.recording, states.place
    assert recording is not None
    assert place is not None
    assert recording.turns is not None
    own = torch.nonzero(~recording.turns)[:, 0]
    plain = replace(recording[own], turns=None)
    return states.replace(recording=plain, place=torch.searchsorted(own, place))


def _slopes(signal: np.ndarray, recording: Recording[States]) -> np.ndarray:
    """Of a signal from the sample before to each, (M,): none at a recording's first."""
    first = recording.first.numpy()
    return np.where(first, np.nan, np.diff(signal, prepend=np.nan) / np.where(first, np.nan, recording.step.numpy()))


def noise(signal: np.ndarray, slope: np.ndarray, step: np.ndarray) -> float:
    """Standard deviation of a signal's noise, which of one that was rounded is that of its last digit at least."""
    return max(_about_lines(signal, slope, step), rounding(signal))


def _about_lines(signal: np.ndarray, slope: np.ndarray, step: np.ndarray) -> float:
    """The same by the median of its second differences, most of which are those of straight lines."""
    second = np.abs(_shifted(slope, -1) - slope) * step
    least = LEAST * float(np.ptp(signal))
    return max(float(np.nanmedian(second)) * MAD / 6**0.5, least) if np.isfinite(second).any() else least


def rounding(signal: np.ndarray) -> float:
    """Standard deviation of what a signal was rounded by, 0 where no step shows: of one that goes on slowly most
    readings are the last one again, and look as if there were no noise.

    >>> round(rounding(np.round(np.linspace(0, 1, 99), 1)), 4)
    0.0289
    """
    gaps = steps(signal)
    if len(gaps) < LEVELS:
        return 0.0
    step = float(gaps.min())
    number = gaps / step
    whole = np.abs(number - number.round()) < WHOLE
    return step / 12**0.5 if whole.all() and np.median(number) < NEXT else 0.0


def steps(signal: np.ndarray) -> np.ndarray:
    """From each value of a signal to the next larger one, (k,). What a change of units leaves in the last binary digits
    is none."""
    gaps = np.diff(np.unique(signal))
    found: np.ndarray = gaps[gaps > SAME * np.abs(signal).max(initial=0.0)]
    return found


def _flicker(signal: np.ndarray, recording: Recording[States]) -> float:
    """Standard deviation of a signal's noise where it may go along lines or along curves."""
    about_lines = _about_lines(signal, _slopes(signal, recording), recording.step.numpy())
    return max(min(about_lines, flicker(signal, recording)), rounding(signal))


def _shifted(values: np.ndarray, by: int) -> np.ndarray:
    """The values of so many samples before, (M,); NaN where there is none. A slope of another recording is no neighbor:
    at a first sample it is NaN, and beyond."""
    found = np.full_like(values, np.nan)
    if by > 0:
        found[by:] = values[:-by]
    else:
        found[:by] = values[-by:]
    return found
