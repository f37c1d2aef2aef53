"""How accurate the measuring was, judged from the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import torch
from scipy.optimize import brentq
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.bed_accuracy import changed, sensors, shared
from freelearn.data.beds import DEG, KPA, MM, NMM, Bed
from freelearn.data.corners import steps
from freelearn.data.moves import moved_by, swept
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.noise.scatter import MAD, Scatter, expected_places, scatter

# What an accuracy was estimated from, in words.
REPEATS = "how repeats of the same state differ"
SMOOTH = "the scatter about everything smooth"
NEIGHBORS = "how neighbors along the pressure differ"
# Repeats of a state count as such within these distances, and within this share of what the quantity ranges over: half
# a millimeter is nothing to a muscle and everything to an artery.
SAME_MM, SAME_DEG, SAME_KPA = 0.5, 1.0, 1.0
SAME_N, SAME_NMM = 0.01, 0.1
SAME_OF_RANGE = 0.02
FEWEST_REPEATS = 10
# Fewest groups of four neighbors that tell a scatter, and how many times as much as theirs is no scatter.
FEWEST_NEIGHBORS, MISTAKEN = 12, 1.5
# Readings that differ by less than this share of the largest are the same.
SAME_SHARE = 1e-9


def estimate(fit: WhiteFit, rows: Rows, like: Accuracy) -> tuple[Accuracy, str]:
    """Accuracy from repeats where there are enough of them, else from the scatter about everything smooth, held to what
    neighbors allow; and from which: REPEATS, SMOOTH or NEIGHBORS. fit: of some model to the rows (N).

    `like` gives the ratio of length to twist error, and what the scatter is compared with; the pressure's error cannot
    be told from the load cells' own. See `scatter`, which is not led astray by a few odd readings.
    """
    sensitivity = sensitivities(fit.model, rows.states)
    repeated = _from_repeats(fit.raw_residual, sensitivity, rows, like)
    if repeated is not None:
        return repeated, REPEATS
    found = scatter(
        fit.raw_residual,
        fit.raw_jacobian,
        fit.shown,
        sensitivity,
        rows.states,
        torch.as_tensor(rows.state),
        replace(like, pressure=0.0),
        readings=rows.readings,
    )
    about_smooth = measured(found, rows.states.bed, _least(rows))
    held = _held_to_neighbors(about_smooth, fit.raw_residual, rows, like)
    return held, SMOOTH if held is about_smooth else NEIGHBORS


def _held_to_neighbors(found: Accuracy, raw: Tensor, rows: Rows, like: Accuracy) -> Accuracy:
    """No larger than neighbors allow: what is left of a reading beside a parabola through the three next to it along
    the pressure is its own error, and at most a little of what the model lacks. Where that is much less than what was
    taken for scatter, a model's misfit was; the places then err by what the readings let expect.

    raw: residuals (N, 2) of some model, which is the smoother the better it is."""
    beside = neighbor_scatter(raw, rows)
    bed = rows.states.bed
    own, there = sensors(found, bed), beside.isfinite()
    if not bool((there & (own > MISTAKEN * beside)).any()):
        return found
    own = torch.where(there, torch.minimum(own, torch.maximum(beside, _least(rows))), own)
    told = rows.readings.present & there
    expected = expected_places(own / sensors(like, bed), told) * shared(like, bed)
    return changed(found, bed, own, torch.minimum(shared(found, bed), expected))


def neighbor_scatter(raw: Tensor, rows: Rows) -> Tensor:
    """Standard deviation of what readings (2,) err by themselves, from four neighbors each along the pressure of one
    visit: their third divided difference knows nothing of any parabola. NaN where there are too few.

    raw: residuals (N, 2)."""
    states = rows.states
    if states.pressure.ndim > 1:
        return torch.full((2,), torch.nan, dtype=raw.dtype)
    pressure, direction = states.pressure.numpy(), np.sign(states.direction.numpy())
    counts = (rows.readings.present & ~rows.readings.slack[:, None]).numpy()
    found: list[list[float]] = [[], []]
    for visit in np.unique(rows.visits):
        for way in np.unique(direction[rows.visits == visit]):
            own = np.flatnonzero((rows.visits == visit) & (direction == way))
            own = own[np.argsort(pressure[own], kind="stable")]
            for channel in range(2):
                place = own[counts[own, channel]]
                found[channel] += _third_differences(pressure[place], raw.numpy()[place, channel])
    sizes = [MAD * np.median(np.abs(each)) if len(each) >= FEWEST_NEIGHBORS else np.nan for each in found]
    return torch.tensor(sizes, dtype=raw.dtype)


def _third_differences(at: np.ndarray, value: np.ndarray) -> list[float]:
    """Third divided differences of every four in a row, of standard deviation one where the values' is one."""
    out = []
    for i in range(len(at) - 3):
        x = at[i : i + 4]
        gaps = x[:, None] - x[None, :] + np.eye(4)
        # Where two are at one place there is no parabola between them.
        if np.abs(gaps).min() <= 0:
            continue
        weight = 1 / gaps.prod(1)
        out.append(float(weight @ value[i : i + 4] / np.linalg.norm(weight)))
    return out


def _least(rows: Rows) -> Tensor:
    """What readings (2,) err by at least, SI: the rounding, and of what shows none a hair: nothing is exact."""
    largest = torch.where(rows.readings.present, rows.readings.value.abs(), 0.0).amax(0)
    return torch.maximum(_resolution(rows), SAME_SHARE * largest)


def _resolution(rows: Rows) -> Tensor:
    """Standard deviation of rounding to the last digit, (2,) SI: of rounded readings, repeats may not differ at all."""
    sizes = []
    for value, there in zip(rows.readings.value.unbind(-1), rows.readings.present.unbind(-1), strict=True):
        gaps = steps(value[there].numpy())
        sizes.append(gaps.min() / 12**0.5 if len(gaps) else 0.0)
    return torch.tensor(sizes, dtype=rows.readings.value.dtype)


def measured(found: Scatter, bed: Bed, least: Tensor | float = 0.0) -> Accuracy:
    """Standard deviations as estimated, at least these (2,); noise that grows with load or pressure at mid-way."""
    place = found.position * found.tails.deviation
    typical = found.deviations * (1 + found.growth.amount / 2)
    own = (typical * sensors(found.like, bed)).clamp_min(torch.as_tensor(least, dtype=typical.dtype))
    return changed(found.like, bed, own, place * shared(found.like, bed))


def _from_repeats(raw: Tensor, sensitivity: Tensor, rows: Rows, like: Accuracy) -> Accuracy | None:
    """From how much visits of the same state and pressure differ: a model's own error is the same in each.

    In the differences, a visit's common part along ∂(F, M)/∂(l, φ) is its position error, and the rest the load cells'
    scatter. Medians, so that a few odd readings do not decide."""
    groups = repeat_rows(rows)
    if len(groups) < FEWEST_REPEATS:
        return None
    residual, bed = raw.numpy(), rows.states.bed
    there = rows.readings.present.any(0).numpy()
    apart: dict[int, np.ndarray] = {}
    for several in groups:
        # Of n alike, one less is free.
        spread = (residual[several] - residual[several].mean(0)) * np.sqrt(len(several) / (len(several) - 1))
        apart.update(zip(several.tolist(), spread, strict=True))
    typical = np.median(np.abs(list(apart.values())), axis=0)
    # Of readings that are rounded coarsely most repeats do not differ at all.
    scale = np.where(typical > 0, typical, _resolution(rows).numpy())
    scale = np.where(there & (scale > 0), scale, 1.0)
    position = sensitivity.numpy()[:, :, :2] * shared(like, bed).numpy() * there[:, None]
    by_visit: dict[int, list[int]] = {}
    for row in apart:
        by_visit.setdefault(int(rows.visits[row]), []).append(row)
    rests, moves, leverage = [], [], []
    for visit in by_visit.values():
        target = np.array([apart[row] for row in visit]) / scale
        if len(visit) < 3:
            rests.append(target * scale)
            continue
        inverse = np.linalg.pinv((position[visit] / scale[:, None]).reshape(-1, 2), rcond=1e-8)
        move = inverse @ target.reshape(-1)
        along = (position[visit] / scale[:, None]) @ move
        rests.append((target - along) * scale / np.sqrt(1 - 1 / len(visit)))
        moves.append(move)
        leverage.append((inverse.reshape(2, -1, 2) ** 2).sum(1))
    own = np.maximum(MAD * np.median(np.abs(np.concatenate(rests)), axis=0), _resolution(rows).numpy()).clip(1e-12)
    own = np.where(there, own, sensors(like, bed).numpy())
    ratio = _beyond(np.array(moves), np.array(leverage) @ (own / scale) ** 2) if moves else 0.0
    return changed(replace(like, pressure=0.0), bed, torch.as_tensor(own), ratio * shared(like, bed))


def _beyond(moves: np.ndarray, variance: np.ndarray) -> float:
    """Standard deviation that moves have beyond what the scatter of their own estimate, of this variance, makes."""
    # What moves nothing that is read (the twist of a bed that measures force alone) tells nothing.
    moves, variance = moves[variance > 0], variance[variance > 0]
    if not len(moves):
        return 0.0

    def excess(square: float) -> float:
        return float(MAD**2 * np.median(moves**2 / (square + variance))) - 1

    most = float(MAD**2 * np.median(moves**2))
    return 0.0 if excess(0.0) <= 0 else float(brentq(excess, 0.0, most)) ** 0.5


def places(states: States) -> pd.DataFrame:
    """Where each row was measured, rounded to what counts as the same: its sample, the two quantities of its state,
    pressures, direction, and of sweeps under one pressure the side from which the bed came."""
    near = {"length": SAME_MM * MM, "twist": SAME_DEG * DEG, "force": SAME_N, "moment": SAME_NMM * NMM}
    grains = [near[quantity.field] for quantity in states.bed.state]
    inputs = states.inputs()
    grains += [SAME_KPA * KPA] * (len(inputs) - 2)
    ranges = [float(x.max() - x.min()) for x in inputs]
    shares = [SAME_OF_RANGE * most if most > 0 else np.inf for most in ranges]
    grains = [min(grain, share) for grain, share in zip(grains, shares, strict=True)]
    rounded = {str(i): (x.numpy() / grain).round() for i, (x, grain) in enumerate(zip(inputs, grains, strict=True))}
    where = pd.DataFrame({"sample": states.sample.numpy(), **rounded, "direction": states.direction.numpy()})
    if not swept(states):
        return where
    # Forth and back under one pressure are no repeats: friction tells them apart.
    along, around = moved_by(states).round().numpy().T
    return where.assign(along=along, around=around)


def repeats(where: pd.DataFrame, state: np.ndarray) -> list[np.ndarray]:
    """Rows of each place that was visited more than once, one row of a visit. state: number of each row's visit."""
    groups = []
    for _, rows in where.groupby(list(where.columns)).indices.items():
        _, first = np.unique(state[rows], return_index=True)
        if len(first) > 1:
            groups.append(np.asarray(rows)[first])
    return groups


def repeat_rows(rows: Rows) -> list[np.ndarray]:
    """`repeats` of the rows, by where they were measured. A log has none: what came before is part of a sample."""
    return repeats(places(rows.states), rows.visits) if rows.states.recording is None else []


def repeat_scale(residual: Tensor, rows: Rows, whiten: Whitener) -> float | None:
    """Scatter between repeats of one state and pressure, in units of the stated noise; None with too few repeats.

    residual: predicted − measured (N, 2) N, N·m; a model's own error is the same in a repeat and drops out. Readings
    that slipped are left out.
    """
    z = (residual / whiten.variance.sqrt().clamp_min(1e-300)).numpy()
    slipped = whiten.scatter.slipped.any(-1).numpy() if whiten.scatter else np.zeros(len(z), dtype=bool)
    there = rows.readings.present.any(0).numpy()
    squares = []
    for group in repeat_rows(rows):
        several = z[group[~slipped[group]]]
        if len(several) > 1:
            squares.append((((several - several.mean(0)) ** 2).sum(0) / (len(several) - 1))[there])
    if len(squares) < FEWEST_REPEATS:
        return None
    return float(np.sqrt(np.mean(squares)))
