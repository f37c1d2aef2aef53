"""How a bed really scattered: estimated from what is left when everything smooth is taken off, slipped readings apart.

A reading's residual is taken for the sum of what the model may absorb, of generic smooth shapes (what a missing effect
leaves), of the position error that its kinematic state shares, and of an error of its own that follows Student's t, but
for a small share of readings that slipped. All of their sizes are estimated by expectation and maximization (Lange,
Little & Taylor 1989 for the t distribution, MacKay 1992 for the smooth shapes), sample by sample. The smooth shapes
keep a missing effect from being taken for slipped readings: a reading that slipped stands apart from its neighbors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.bed_accuracy import sensors, shared
from freelearn.data.beds import KINEMATIC
from freelearn.data.rows import Readings
from freelearn.data.states import States
from freelearn.discovery.noise.memory import Filter, Memory, remembered
from freelearn.discovery.noise.shapes import FEWEST_BINS, SHARING, rows_of_samples
from freelearn.discovery.noise.smooth import Part, Smooth
from freelearn.discovery.noise.tails import EVEN, Growth, Tails, fitted, grown

# Rounds of the estimate: at first, and from where an earlier one of nearly the same model ended.
ROUNDS, AGAIN = 11, 2
# Rounds in which influence is bounded but never falls to zero (Huber's weights), so that the start does not decide.
CAUTIOUS, HUBER = 5, 2.0
# Last rounds in which it is asked how the noise grows.
GROWING = 2
# What is expected of the position error is believed as much as so many states would make it: calibration certificates
# of stages differ from what is true by a factor of about 1.4.
PRIOR_STATES = 3.0
# Who misstates the errors of the readings misstates those of the places: to this power, and within these factors.
TOGETHER, EXPECTED = 0.55, (0.5, 2.0)
# With fewer states of any sample no smooth shape is told from position errors: these are then what is expected.
FEWEST_STATES = SHARING * FEWEST_BINS
# Residuals are counted as typically so many deviations of a channel's noise at most. Of a model that is farther off,
# more digits of one channel would decide against the other, and nothing about the model.
HOPELESS = 30.0
# A reading is grossly wrong that exceeds 9 of 10 others so many times, where a fit that bounds its influence expects
# none such, and that misses this by more than those others are large and so many times what is usual. A larger share of
# the readings is no error: something else happens there.
OUTSIDE, STRAY, MOST_GROSS = 1.5, 30.0, 0.1
MAD = 1.4826  # of a normal distribution: standard deviation over median absolute deviation


@dataclass(frozen=True)
class Scatter:
    """How N rows scattered.

    like: the stated accuracy. scale (2,): of a force's and a moment's error (the pressure's share included), in units
    of the stated one. position: of length and twist errors, in units of the stated ones. growth: of errors with load or
    pressure. tails: of the errors about that. z (N, 2): errors about what is expected, in units of their scale; smooth
    (N, 2) N, N·m: what is expected of the residuals. good (N, 2): chance that a reading did not slip. reading (N, 2)
    and state (N,): precision (one over the variance) of a reading's and of its state's position error, in units of
    the stated one; zero for a reading that slipped. variances: of the smooth shapes, to go on from. lifted (2,):
    factors by which the errors count as larger in `reading`, because the model is far off, see HOPELESS. weight (N, 2):
    precision of a reading's own error, in units of what is usual. memory: of the errors of a log, None where there is
    none. assumed: whether position is what the readings' scale lets expect, of too few states to tell.
    """

    like: Accuracy
    scale: Tensor
    position: float
    growth: Growth
    tails: Tails
    z: Tensor
    smooth: Tensor
    good: Tensor
    reading: Tensor
    state: Tensor
    variances: tuple[Tensor, ...]
    lifted: Tensor
    weight: Tensor
    memory: Memory | None = None
    assumed: bool = True
    gross: Tensor | None = None

    def of(self, rows: Tensor) -> Scatter:
        """That of some of the rows alone, (n,) int64: to weigh them by, not to go on from."""
        picked = {n: getattr(self, n)[rows] for n in ("z", "smooth", "good", "reading", "state", "weight")}
        return replace(self, **picked, gross=None if self.gross is None else self.gross[rows])

    def even(self) -> Scatter:
        """All readings that did not slip with the usual precision, and nothing that a state's rows share: what stands
        out of a model that is far off is its misfit, which must neither count for less nor be given to the places."""
        right = (self.weight > 0) & ~self.slipped
        return replace(self, reading=torch.where(right, self.reading / self.weight, 0.0), position=0.0)

    def wider(self, times: float) -> Scatter:
        """All errors so many times as large."""
        return replace(
            self, scale=times * self.scale, position=times * self.position, z=self.z / times,
            reading=self.reading / times**2,
        )  # fmt: skip

    @property
    def slipped(self) -> Tensor:
        """Readings to point out, (N, 2) bool."""
        far = self.z.abs() > self.tails.limit * self.lifted
        return far if self.gross is None else far | self.gross

    @property
    def deviations(self) -> Tensor:
        """Standard deviations of force and moment errors at no load, in units of the stated ones, (2,)."""
        return self.scale * self.tails.deviation


def scatter(
    raw: Tensor,
    jacobian: Tensor,
    loads: Tensor,
    sensitivity: Tensor,
    states: States,
    state: Tensor,
    like: Accuracy,
    before: Scatter | None = None,
    readings: Readings | None = None,
) -> Scatter:
    """Estimates the scatter of N rows.

    raw: predicted − measured (N, 2) of a fit; jacobian (N, 2, p): its derivatives; loads (N, 2): as predicted, which
    errors may grow with. sensitivity: (N, 2, 3), see `sensitivities`. state: number of each row's kinematic state,
    (N,) int64. like: the stated accuracy. before: an earlier estimate of the same rows, to go on from. readings: the
    rows', where some are blank or censored: those that are tell nothing of the scatter.
    """
    bed = states.bed
    readings = readings or Readings.whole(raw)
    told = readings.informative_mask(loads)
    gross = _gross(raw, loads, told, states.pressure) if before is None else before.gross
    told = told if gross is None else told & ~gross
    noise = (sensors(like, bed) ** 2 + (sensitivity[:, :, 2:] * like.pressure).square().sum(-1)).sqrt()
    positions = sensitivity[:, :, :2] * shared(like, bed)
    samples = [
        Smooth(rows, raw[rows], jacobian[rows], noise[rows], positions[rows], states[rows], state[rows], told[rows])
        for rows in rows_of_samples(states)
    ]
    visit, clock = state, clock_of(states)
    now = before or _unknown(raw, noise, like, told)
    if before:
        for sample, variance in zip(samples, before.variances, strict=True):
            sample.variance = variance
        now = replace(now, reading=before.reading * before.lifted**2)
    rounds = AGAIN if before else ROUNDS
    for turn in range(rounds):
        base = noise * now.scale * now.growth.factor(loads, states.pressure)
        weight = torch.where(told, now.reading * (base / noise) ** 2, 0.0)
        forget = None if now.memory is None or clock is None else fading(now.memory, weight, visit, clock)
        parts = [
            s.expected(base[s.rows], weight[s.rows], now.position, now.state[s.rows], forget and forget.part(s.rows))
            for s in samples
        ]
        cautious = not before and turn < CAUTIOUS
        now = _updated(now, samples, parts, base, loads, states.pressure, told, cautious, rounds - turn <= GROWING)
        if clock is not None and not cautious:
            size = noise * now.scale * now.growth.factor(loads, states.pressure)
            error, whole, counts = (
                torch.where(told, x, 0.0) for x in ((raw - now.smooth) / size, raw / size, now.weight)
            )
            memory = remembered(error, counts, visit, clock)
            now = replace(now, memory=None if memory is None else _seen_in(memory, whole, counts, visit, clock))
    # Places that are off as stated are no misfit, however much a stiff actuator makes of them.
    places = (min(now.position, 1.0) * positions).square().sum(-1)
    beyond = (raw.square() - places).clamp_min(0.0).sqrt()
    lifted = (_typical(beyond / (noise * now.deviations), told) / HOPELESS).clamp_min(1.0)
    # What is censored is believed like any other, once the model comes to it; what is not there never.
    there = readings.present
    if gross is not None:
        size = noise * now.scale * now.growth.factor(loads, states.pressure)
        z, good = torch.where(gross, (raw - now.smooth) / size, now.z), torch.where(gross, 0.0, now.good)
        there, now = there & ~gross, replace(now, z=z, good=good, gross=gross)
    return replace(now, reading=torch.where(there, now.reading / lifted**2, 0.0), lifted=lifted)


def _gross(raw: Tensor, loads: Tensor, told: Tensor, pressure: Tensor) -> Tensor | None:
    """Readings that are grossly wrong, (N, 2) bool, of a fit in which no reading has more than bounded influence; None
    where there are none. raw, loads: as for `scatter`; told: (N, 2) bool, readings that tell something. What is read
    under a pressure (N,) that no other row reaches may be as large as it is."""
    found = torch.zeros_like(told)
    for load in range(2):
        there = told[:, load]
        if not bool(there.any()):
            continue
        shown, missed = (loads - raw)[there, load].abs(), raw[there, load].abs()
        large = shown.quantile(1 - MOST_GROSS)
        off = (shown > OUTSIDE * large) & (missed > large) & (missed > STRAY * MAD * missed.median())
        off &= loads[there, load].abs() <= OUTSIDE * large
        if bool(off.any()):
            # Not all of them: at most one of ten exceeds nine others.
            off &= pressure[there] <= pressure[there][~off].max()
        if int(off.sum()) <= MOST_GROSS * len(off):
            found[there, load] = off
    return found if bool(found.any()) else None


def huber(
    raw: Tensor, like: Accuracy, power: int = 1, states: States | None = None, told: Tensor | None = None
) -> Scatter:
    """Huber's weights to a power for residuals (N, 2) of which nothing is known yet, in units of their own size.

    states: the rows', where their bed is not kinematic. told: (N, 2) bool, readings that tell something of that size,
    all by default."""
    noise = sensors(like, states.bed if states else KINEMATIC).expand_as(raw)
    unknown = _unknown(raw, noise, like, torch.ones_like(raw, dtype=torch.bool) if told is None else told)
    return replace(unknown, reading=_bounded(unknown.z) ** power)


def _bounded(z: Tensor) -> Tensor:
    return (HUBER / z.abs().clamp_min(1e-9)).clamp_max(1.0)


def _unknown(raw: Tensor, noise: Tensor, like: Accuracy, told: Tensor) -> Scatter:
    """Where the first estimate starts: all of the residuals is noise, and what is far off counts for next to nothing,
    since a reading that slipped far bends all that is fitted to it."""
    scale = _typical(raw / noise, told)
    z = raw / noise / scale
    one = torch.ones_like(raw)
    reading = _bounded(z) ** 2 / scale**2
    state = torch.ones(len(raw), dtype=torch.float64)
    return Scatter(
        like, scale, 1.0, EVEN, Tails(), z, 0 * one, one, reading, state, (), torch.ones_like(scale), _bounded(z) ** 2
    )


def _seen_in(memory: Memory, whole: Tensor, counts: Tensor, visit: Tensor, clock: Tensor) -> Memory | None:
    """A memory of what is left without smooth shapes, as far as what is left with them (N, 2) has one, but for what a
    recording has in common: shapes and a memory that were once there for a misfit hold each other up, one the other's
    opposite, in errors that are white."""
    sums, number = (torch.zeros(int(visit.max()) + 1, 2, dtype=whole.dtype).index_add_(0, visit, x) for x in (
        whole * counts, counts
    ))  # fmt: skip
    own = torch.where(counts > 0, whole - (sums / number.clamp_min(1e-300))[visit], 0.0)
    seen = remembered(own, counts, visit, clock)
    if seen is None:
        return None
    share = torch.where(seen.share > 0, memory.share, 0.0)
    return replace(memory, share=share) if bool(share.any()) else None


def _typical(z: Tensor, told: Tensor) -> Tensor:
    """Robust size (2,) of what is told in either channel; one where nothing is."""
    sizes = [
        MAD * each[there].abs().median() if bool(there.any()) else torch.ones((), dtype=z.dtype)
        for each, there in zip(z.unbind(-1), told.unbind(-1), strict=True)
    ]
    return torch.stack(sizes).clamp_min(1e-6)


def clock_of(states: States) -> Tensor | None:
    """The time of each row of a log, (N,) s; None of any other table."""
    if states.recording is None or states.place is None:
        return None
    return states.recording.time[states.place]


def fading(memory: Memory, weight: Tensor, visit: Tensor, clock: Tensor) -> Filter:
    """What takes a memory off errors in units of their own size. weight (N, 2): their white parts' precision, in units
    of what is usual; zero for what does not count."""
    return Filter(memory, memory.share * weight, (1 - memory.share).expand_as(weight), visit, clock)


def expected_places(deviations: Tensor, told: Tensor) -> float:
    """The scale of position errors, in units of the stated ones, that the readings' (2,) let expect."""
    read = deviations[told.any(0)]
    together = float(read.log().mean().exp()) ** TOGETHER if len(read) else 1.0
    return min(max(together, EXPECTED[0]), EXPECTED[1])


def _updated(
    now: Scatter, samples: list[Smooth], parts: list[Part], base: Tensor, loads: Tensor, pressure: Tensor, told: Tensor,
    cautious: bool, growing: bool,
) -> Scatter:  # fmt: skip
    """The estimate after one round. growing: whether it is asked once more how the noise grows."""
    error, spread, smooth = (torch.zeros_like(base) for _ in range(3))
    state = torch.ones(len(base), dtype=torch.float64)
    for sample, part in zip(samples, parts, strict=True):
        error[sample.rows], spread[sample.rows], smooth[sample.rows] = part.error, part.spread, part.expected
    z = torch.where(told, error / (base**2 + spread).sqrt(), 0.0)
    scale, growth, tails = now.scale, now.growth, now.tails
    if cautious:
        size = _typical(z, told)
        weight, good = _bounded(z / size), torch.ones_like(z)
        scale = scale * size
        z = z / size
    else:
        good = torch.as_tensor(tails.good(z.numpy()))
        weight = good * torch.as_tensor(tails.weight(z.numpy()))
        each = ((weight * z.square()).sum(0) / (good * told).sum(0).clamp_min(1.0)).sqrt().clamp(0.2, 5.0)
        each = torch.where(told.any(0), each, 1.0)
        z, scale = z / each, scale * each
        tails, common = fitted(z[told].numpy(), tails)
        z, scale = z / common, scale * common
        if growing:
            before = growth.factor(loads, pressure)
            growth, size = grown(z * before, loads, pressure, tails, told)
            z, scale = z * before / growth.factor(loads, pressure) / size, scale * size
        good = torch.as_tensor(tails.good(z.numpy()))
        weight = good * torch.as_tensor(tails.weight(z.numpy()))
    moved = torch.cat([part.moved for part in parts])
    precision = (tails.freedom + 2) / (tails.freedom + moved) if np.isfinite(tails.freedom) else torch.ones_like(moved)
    position = expected = expected_places(scale * tails.deviation, told)
    assumed = max(sample.states for sample in samples) < FEWEST_STATES
    if not assumed:
        total = float((precision * moved).sum()) + 2 * PRIOR_STATES * (expected / now.position) ** 2
        position = now.position * (total / (2 * len(moved) + 2 * PRIOR_STATES)) ** 0.5
    at = 0
    for sample in samples:
        state[sample.rows] = precision[at : at + sample.states][sample.state]
        at += sample.states
    reading = weight / (scale * growth.factor(loads, pressure)) ** 2
    variances = tuple(sample.variance for sample in samples)
    return replace(
        now, scale=scale, position=position, growth=growth, tails=tails, z=z, smooth=smooth, good=good,
        reading=reading, state=state, variances=variances, weight=weight, assumed=assumed,
    )  # fmt: skip
