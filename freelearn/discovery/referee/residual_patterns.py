"""What residuals look like, in the order of measuring, level by level, and beside the accuracy that is stated."""

from __future__ import annotations

import numpy as np
import torch
from scipy import stats

from freelearn.data.bed_accuracy import sensors, shared
from freelearn.data.beds import Quantity
from freelearn.discovery.noise.memory import Memory
from freelearn.discovery.noise.scatter import MAD, clock_of
from freelearn.discovery.referee.case import CANNOT, CERTIFIED, FAIL, PASS, Case, Check

# What residuals look like in the order of measuring, in rising and falling pressure, level by level; and bands.

# Chance at which a pattern counts, of few that are looked at; and the size in σ below which it does not matter.
CHANCE, MATTERS = 1e-4, 0.5
FEWEST = 20
# Share of new readings that 95 % bands must hold, of those left out; and chance of fewer.
HOLD = 0.85


def patterns(case: Case, raw: torch.Tensor | None = None) -> list[Check]:
    """raw: residuals (N, 2) of rows that were left out, for the bands."""
    return [_order(case), _branches(case), *([] if raw is None else [_bands(case, raw)])]


def _white(case: Case) -> np.ndarray:
    """Whitened residuals, (N, 2), NaN where nothing was read."""
    white: np.ndarray = np.where(case.present.numpy(), case.fit.residual.numpy(), np.nan)
    return white


def _order(case: Case) -> Check:
    """Neighbors in the order of measuring: correlation of each residual with the next of the same channel."""
    white, sample = _white(case), case.rows.states.sample.numpy()
    pairs = [
        (a, b)
        for channel in white.T
        for a, b, same in zip(channel[:-1], channel[1:], sample[1:] == sample[:-1], strict=True)
        if same and np.isfinite(a) and np.isfinite(b)
    ]
    name = "order of measuring"
    if len(pairs) < FEWEST:
        return Check(name, CANNOT, None, None, "Too few rows follow each other.", decides=False)
    correlation = float(stats.spearmanr(*np.array(pairs).T).statistic)
    chance = float(2 * stats.norm.sf(abs(correlation) * np.sqrt(len(pairs))))
    says = f"Each residual and the next one correlate by {correlation:.2f}."
    if chance < CHANCE and abs(correlation) > MATTERS:
        return Check(name, FAIL, abs(correlation), MATTERS, f"{says} What is left goes on from row to row.")
    return Check(name, PASS, abs(correlation), MATTERS, says, decides=False)


def _branches(case: Case) -> Check:
    """Rising against falling pressure."""
    direction, white = case.rows.states.direction.numpy(), _white(case)
    name = "rising against falling"
    if min((direction > 0).sum(), (direction < 0).sum()) < FEWEST / 2:
        return Check(name, CANNOT, None, None, "The rows hardly have both rising and falling pressure.", decides=False)
    worst, chance = 0.0, 1.0
    for channel in white.T:
        up, down = (channel[(direction == s) & np.isfinite(channel)] for s in (1, -1))
        if min(len(up), len(down)) < FEWEST / 2:
            continue
        p = float(stats.ttest_ind(up, down, equal_var=False).pvalue)
        if p < chance:
            worst, chance = float(up.mean() - down.mean()), p
    says = f"Between rising and falling pressure residuals differ by {abs(worst):.2f} σ."
    if chance < CHANCE and abs(worst) > MATTERS:
        return Check(name, FAIL, abs(worst), MATTERS, says)
    return Check(name, PASS, abs(worst), MATTERS, says)


def _bands(case: Case, raw: torch.Tensor) -> Check:
    """Share of readings left out that lie within 95 % of noise and parameters."""
    by = case.fit.raw_jacobian
    variance = case.noise + torch.einsum("ncp,pq,ncq->nc", by, case.covariance, by).clamp_min(0)
    inside = raw.abs() <= 1.96 * variance.sqrt()
    share = float(inside[case.present].double().mean()) if bool(case.present.any()) else 1.0
    says = f"95 % bands hold {100 * share:.0f} % of the readings that were left out."
    if share < HOLD and case.states >= FEWEST:
        return Check("bands", FAIL, share, HOLD, says)
    return Check("bands", PASS if share >= HOLD else CANNOT, share, HOLD, says, decides=False)


# Is the accuracy that the user states what the rows need?

# Share of the scatter that must be there from each row to the next, where it is scatter and no misfit.
ROUGH = 0.6
# Factor beyond which errors of places count as a misfit, and errors that a sensor makes for a while.
MOST, LASTING = 3.5, 5.0
FEWEST_INNER = 12


def stated(case: Case) -> list[Check]:
    """One check for the readings, one for what of their errors lasts, one for the places."""
    scatter = case.whiten.scatter
    if scatter is None:
        return []
    bed = case.rows.states.bed
    checks = []
    for channel, quantity in enumerate(bed.readings):
        if not bool(case.present[:, channel].any()):
            continue
        told = float(sensors(case.accuracy, bed)[channel]) / quantity.factor
        factor = float(scatter.deviations[channel])
        says = f"The {quantity.name} scatters by {factor * told:.2g}{quantity.suffix}; you say {told:.2g}."
        name = f"accuracy of the {quantity.name}"
        rough = roughness(case, channel)
        if factor > CERTIFIED and rough is not None and rough < ROUGH:
            says += f" From row to row it is {100 * rough:.0f} % of that: most of it is no scatter but a misfit."
            checks.append(Check(name, FAIL, factor, CERTIFIED, says))
        elif factor < 1 / CERTIFIED:
            says += " The stated one would hide what is missing; the search took the scatter as it is."
            checks.append(Check(name, PASS, factor, 1 / CERTIFIED, says, decides=False))
        else:
            if factor > CERTIFIED and rough is not None:
                # A figure beyond its threshold that passes has to say why.
                says += f" From row to row it is {100 * rough:.0f} % of that: noise, no misfit."
            elif factor > CERTIFIED:
                says += " Too few rows stand next to each other to tell noise from a misfit."
            checks.append(Check(name, PASS, factor, CERTIFIED, says, decides=False))
        if scatter.memory is not None and float(scatter.memory.share[channel]) > 0:
            checks.append(_lasting(quantity, scatter.memory, channel, factor, told))
    place = float(scatter.position * scatter.tails.deviation)
    words = [
        f"{q.name} {place * float(value) / q.factor:.2g}{q.suffix} (you say {float(value) / q.factor:.2g})"
        for q, value in zip(bed.state, shared(case.accuracy, bed), strict=True)
        if float(value) > 0
    ]
    if words:
        says = f"What a state's rows share would have to be off by {' and '.join(words)}."
        checks.append(Check("accuracy of the places", FAIL if place > MOST else PASS, place, MOST, says, place > MOST))
    return checks


def _lasting(quantity: Quantity, memory: Memory, channel: int, factor: float, told: float) -> Check:
    """Errors of a sensor that last for a while: a wandering zero, or a history that no shape tells."""
    lasts = factor * float(memory.share[channel]) ** 0.5
    says = (
        f"The {quantity.name} errs by {lasts * told:.2g}{quantity.suffix} for {float(memory.time[channel]):.2g} s; "
        f"you say {told:.2g}."
    )
    name = f"errors of the {quantity.name} that last"
    if lasts > LASTING:
        says += " No sensor wanders by so much: something with a memory is missing. Or state what its data sheet says."
        return Check(name, FAIL, lasts, LASTING, says)
    return Check(name, PASS, lasts, LASTING, says, decides=False)


def roughness(case: Case, channel: int) -> float | None:
    """How much residuals differ from the mean of their neighbors along the pressure, as a share of what errors of the
    size and memory that were found would; None of too few."""
    raw = case.fit.raw_residual[:, channel].numpy() / np.maximum(case.whiten.own[:, channel].numpy(), 1e-300)
    there, state = case.present[:, channel].numpy(), case.rows.state
    inner = np.flatnonzero(
        there[1:-1] & there[:-2] & there[2:] & (state[1:-1] == state[:-2]) & (state[1:-1] == state[2:])
    )
    if len(inner) < FEWEST_INNER:
        return None
    second = raw[inner + 1] - (raw[inner] + raw[inner + 2]) / 2
    return float(MAD * np.median(np.abs(second)) / np.sqrt(_rough(case, channel, inner)))


def _rough(case: Case, channel: int, inner: np.ndarray) -> float:
    """Variance of the difference between an error and the mean of its neighbors, of errors of variance one."""
    scatter, clock = case.whiten.scatter, clock_of(case.rows.states)
    if scatter is None or scatter.memory is None or clock is None:
        return 1.5
    share, time = float(scatter.memory.share[channel]), float(scatter.memory.time[channel])
    before, after = (np.abs(np.diff(clock.numpy()))[inner + i] for i in (0, 1))
    near = np.exp(-before / time) + np.exp(-after / time) - np.exp(-(before + after) / time) / 2
    return float(1.5 - share * np.median(near))
