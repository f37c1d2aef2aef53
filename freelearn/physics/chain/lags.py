"""What effects of the history share: a first-order lag and elements that stick and slip, along recordings."""

from __future__ import annotations

import itertools
import math

import torch
from torch import Tensor

from freelearn.data.recordings import STEPPING, Recording, recurred, stopped, turned
from freelearn.data.states import States
from freelearn.data.stops import Spread, stops

# No lag is shorter [s]; below it nothing is left of one.
SHORTEST = 1e-9
# Steps in units of a lag's time below which a series is more exact than what it stands for.
FLAT = 0.03
# No delay is longer [s].
LONGEST = 30.0
# Elements that stick; of exp(−r), the power of which equal steps lie between them.
ELEMENTS, POWER = 16, 0.75


def exponential(count: int) -> Spread:
    """Elements that stand for thresholds that are spread exponentially about one, as ratios to their mean.

    The loop that they make is a chain of straight pieces in place of a curve. Cut at equal steps of exp(−r/2) these
    would be off it by as much everywhere, but too far apart at small thresholds for a fit to get past; cut at equal
    shares, exp(−r), the last ones are off by many times the others. Each stands at the mean of its part.
    """
    cut = [-math.log(1 - k / count) / POWER for k in range(count)]
    beyond = [math.exp(-r) for r in cut] + [0.0]
    above = [(r + 1) * left for r, left in zip(cut, beyond, strict=False)] + [0.0]
    shares = [one - two for one, two in itertools.pairwise(beyond)]
    ratios = [(one - two) / share for (one, two), share in zip(itertools.pairwise(above), shares, strict=True)]
    return Spread(tuple(ratios), tuple(shares))


SPREAD = exponential(ELEMENTS)


def bend(signal: Tensor, recording: Recording[States]) -> Tensor | None:
    """Half the second derivative of a signal (M, c) on the way to each sample of a measured log, (M, c): while what is
    imposed goes straight on, loads go along a curve. Zero where no three samples tell; None where none do at all."""
    if recording.calm is None or not recording.calm.straight:
        return None
    step = torch.where(recording.first, 1.0, recording.step)[:, None]
    slope = recording.change(signal) / step
    within = recording.calm.within.to(signal.device)[:, None]
    none = torch.zeros_like(signal[:1])
    curve = torch.cat([none, (slope[2:] - slope[1:-1]) / (step[2:] + step[1:-1]), none])
    curve = torch.where(within, curve, 0.0)
    before = torch.cat([curve[:1], curve[:-1]])
    told = within.to(signal.dtype) + torch.cat([within[:1], within[:-1]])
    return torch.where(recording.first[:, None], 0.0, (curve + before) / told.clamp_min(1.0))


def lag(signal: Tensor, recording: Recording[States], time: Tensor) -> Tensor:
    """By how much x is ahead of y with τ y' = x − y, (M, c): exact where x is a straight line from sample to sample, or
    a parabola along a line of what was imposed.

    signal: x (M, c); time: τ [s], (), (c,) or (M, 1). At a recording's first sample y = x: it had stood still.
    """
    first, step = recording.first[:, None], recording.step[:, None]
    step = torch.where(first, 1.0, step)
    left = torch.where(first, 0.0, torch.exp(-step / time.clamp_min(SHORTEST)))
    ahead = (1 - left) * (time / step) * recording.change(signal)
    curve = bend(signal, recording)
    return recurred(left, ahead if curve is None else ahead + curve * _bent(step, time.clamp_min(SHORTEST)))


def _bent(step: Tensor, time: Tensor) -> Tensor:
    """What x = t (t − h) is ahead by after a step h [s], τ² (a − 2 + (2 + a) exp(−a)) with a = h/τ: (M, c) s²."""
    a = step / time
    series = a * a * a * (1 / 6 - a * (1 / 12 - a * (1 / 40 - a / 180)))
    return time * time * torch.where(a < FLAT, series, a - 2 + (a + 2) * torch.exp(-a))


def rung(signal: Tensor, recording: Recording[States], period: Tensor, damping: Tensor) -> Tensor:
    """y with y'' + 2ζω y' + ω² (y − x) = 0, (M, c): exact where x is a straight line from sample to sample, or a
    parabola along a line of what was imposed.

    signal: x (M, c); period: 2π/ω [s], (c,), and damping: 0 < ζ < 1, (), of the ringing. At a recording's first sample
    y = x stands still.
    """
    first, step = recording.first[:, None], recording.step[:, None]
    omega = 2 * math.pi / period.clamp_min(SHORTEST)
    slope = recording.change(signal) / torch.where(first, 1.0, step)
    ringing = omega * (1 - damping**2).sqrt()
    fades = torch.where(first, 0.0, torch.exp(-damping * omega * step))
    cosine, sine = torch.cos(ringing * step), torch.sin(ringing * step) / ringing
    across = damping * omega * sine
    turn = (
        (fades * (cosine + across), fades * sine),
        (-fades * omega**2 * sine, fades * (cosine - across)),
    )
    # What y − x and y' are where x has gone on as it does for long: at the beginning of the step, and at its end.
    late = 2 * damping / omega
    begun = last = -late * slope, slope
    curve = bend(signal, recording)
    if curve is not None:
        curved = 2 * curve * (late**2 - 1 / omega**2)
        beginning, slope = slope - curve * step, slope + curve * step
        begun = curved - late * beginning, beginning - 2 * late * curve
        last = curved - late * slope, slope - 2 * late * curve
    added = tuple(end - row[0] * begun[0] - row[1] * begun[1] for end, row in zip(last, turn, strict=True))
    behind, _ = turned(turn, (added[0], added[1]))
    # Without a period: the signal itself, whose slope by the period is that of short swings.
    return signal + torch.where(period > 0, behind, -damping / math.pi * period * slope)


def held(signal: Tensor, recording: Recording[States], low: Tensor, high: Tensor) -> Tensor:
    """What of a signal's changes elements that stick hold back together, (M, c): Σ sᵢ stopᵢ(x).

    signal: x (M, c). low ≤ 0 ≤ high, (M, c) or (c,): mean thresholds of the elements, beyond which they slip. At a
    recording's first sample they hold nothing.
    """
    if STEPPING.get() is None:
        bounds = [bound.expand(len(signal) if bound.ndim > 1 else 1, signal.shape[1]) for bound in (low, high)]
        return stops(signal, bounds[0], bounds[1], SPREAD, recording.first)
    ratio, share = (torch.tensor(each, dtype=signal.dtype, device=signal.device) for each in SPREAD)
    free = ~recording.first[:, None, None]
    floor, roof = (torch.where(free, bound[..., None] * ratio, 0.0) for bound in (low, high))
    return stopped(signal[..., None], floor, roof) @ share


def delayed(signal: Tensor, recording: Recording[States], delay: Tensor) -> Tensor:
    """x(t − T), (M, c): a straight line between samples, and beyond a recording's ends what it has there.

    signal: x (M, c); delay: T [s], (), of either sign.
    """
    if (one := STEPPING.get()) is not None:
        return one.delayed(signal, delay)
    whole = recording.strung(2 * LONGEST)
    asked = whole - delay
    begun, ended = recording.ends
    after = torch.searchsorted(whole, asked.detach().contiguous())
    after = torch.minimum(torch.maximum(after, begun + 1), torch.maximum(ended, begun + 1)).clamp_max(len(whole) - 1)
    start, end = whole[after - 1], whole[after]
    left = ((end - asked) / torch.where(end > start, end - start, 1.0)).clamp(0.0, 1.0)[:, None]
    line = signal[after] - left * (signal[after] - signal[after - 1])
    return torch.where(left >= 1, signal[after - 1], line)
