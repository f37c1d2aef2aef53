"""Readings, and places of kinematic states, that slipped, perhaps: which, by how much, and how it may have happened."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.bed_accuracy import shared
from freelearn.data.beds import DEG, ELONGATION, NMM
from freelearn.data.rows import Rows
from freelearn.discovery.fits.step import Step
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.noise import Noise, sensitivities
from freelearn.discovery.noise.scatter import Scatter

# Readings that slipped, perhaps: which, by how much, and how it may have happened.

# What a reading in another unit is multiplied by to be right; N·m for N·mm looks like a decimal shift.
UNITS = {
    "force": {"pounds-force": 4.4482216, "kilograms-force": 9.80665, "ounces-force": 0.27801385},
    "moment": {"inch-pounds": 0.112984829 / NMM},
    "elongation": {"inches": 25.4},
    "outer diameter": {"inches": 25.4},
    "twist": {"radians": 1 / DEG},
}
DECIMALS = (10.0, 100.0, 1000.0)
# A slip explains a reading if what is left then is this many standard deviations, and this share of what it was.
WITHIN, SHARE = 4.0, 0.1
# So many readings far off, as like each other as this (in units of how far off they are), come from a stuck sensor.
FEWEST_STUCK, ALIKE = 4, 0.05


@dataclass(frozen=True)
class Suspect:
    """row: place among the rows that were asked about (Question.rows). load: "force", "moment", or what else the bed
    measures. shown, expected:
    SI, the latter by the last model and what is smooth in its misfit. sigmas: signed. slip: how it probably slipped, in
    words, "" where nothing fits. rows: places of all rows concerned where a block slipped together, (row,) otherwise.
    source: place of the row whose reading it may be, if any.
    """

    row: int
    load: str
    shown: float
    expected: float
    sigmas: float
    slip: str
    rows: tuple[int, ...]
    source: int | None = None


def suspects(step: Step, rows: Rows, kept: np.ndarray) -> list[Suspect]:
    """The readings that do not belong to the others, the farthest off first. kept: which of the rows that were asked
    about the step's rows (N) are."""
    scatter = step.whiten.scatter
    if scatter is None:
        return []
    place = np.flatnonzero(kept)
    expected = step.fit.shown - scatter.smooth
    out = []
    for row, load in torch.nonzero(scatter.slipped).tolist():
        shown, right = float(rows.loads[row, load]), float(expected[row, load])
        sigmas = -float(scatter.z[row, load]) / scatter.tails.deviation
        slip, source = _slip(row, load, right, abs((shown - right) / sigmas), rows, scatter)
        found = None if source is None else int(place[source])
        at = int(place[row])
        out.append(Suspect(at, rows.states.bed.readings[load].name, shown, right, sigmas, slip, (at,), found))
    return sorted(out, key=lambda s: -abs(s.sigmas))


def _slip(
    row: int, load: int, expected: float, deviation: float, rows: Rows, scatter: Scatter
) -> tuple[str, int | None]:
    """How the reading may have slipped, in words, and whose it may be."""
    loads, sample = rows.loads[:, load].numpy(), rows.states.sample.numpy()
    there = rows.readings.present[:, load].numpy()
    shown = loads[row]
    # The very same number elsewhere is no accident, unless the table is rounded so far that many are the same.
    same = np.flatnonzero((loads == shown) & (sample == sample[row]) & there)
    same = same[same != row]
    if len(same) and len(np.unique(loads[there])) > 0.9 * there.sum():
        if row and row - 1 in same:
            return "stuck: the reading of the row before", row - 1
        return "another row's reading", int(same[np.abs(same - row).argmin()])
    slipped = torch.nonzero(scatter.slipped[:, load])[:, 0].numpy()
    near = np.abs(loads[slipped] - shown) <= ALIKE * abs(shown - expected)
    alike = slipped[near & (sample[slipped] == sample[row])]
    if len(alike) >= FEWEST_STUCK:
        return f"stuck: {len(alike)} readings far off show nearly the same", None
    tolerance = min(WITHIN * deviation, SHARE * abs(shown - expected))
    for text, factor in _factors(rows.states.bed.readings[load].name):
        if abs(shown * factor - expected) <= tolerance:
            return text, None
    for other in slipped.tolist():
        if other != row and sample[other] == sample[row] and abs(loads[other] - expected) <= tolerance:
            return "swapped with another row's reading", other
    return "", None


def _factors(load: str) -> list[tuple[str, float]]:
    """What makes a slipped reading right, in words, the likeliest first."""
    factors = [("sign turned", -1.0)]
    factors += [(f"decimal shift: {f:g} times too small", f) for f in DECIMALS]
    factors += [(f"decimal shift: {f:g} times too large", 1 / f) for f in DECIMALS]
    factors += [(f"unit factor: in {unit}", f) for unit, f in UNITS.get(load, {}).items()]
    return factors


# Kinematic states whose place slipped, perhaps: all rows of a state agree if it was somewhere else.

# A place is pointed out if moving it gains so many χ² for each row that tells it, beyond this floor,
EACH, LEAST = 1.0, 60.0
# if it takes away this share of its state's misfit, and if it moves by so many standard deviations of a place.
TAKES, FAR = 0.6, 4.0
# More states than this share (one of few) are no slips: the model errs there.
MOST = 0.05
# Where a model lacks something: the share of what is left beyond the noise that they are, and states at least, of fewer
# of which one may just be where the model errs most.
MAIN, FEWEST = 0.5, 10


def state_outliers(step: Step, rows: Rows, kept: np.ndarray, lacking: bool = False) -> list[Suspect]:
    """The states (of what a bed imposes on one) that seem to have been elsewhere, the clearest first.

    For either quantity of each state the whitened residuals are regressed on how its rows answer to it, cleared of what
    the model's parameters absorb. kept: which of the rows that were asked about the step's rows (N) are. lacking:
    whether the model leaves something systematic: any state may then look misplaced, and only such are told as are most
    of what is left.
    """
    scatter, bed = step.whiten.scatter, rows.states.bed
    if scatter is None:
        return []
    told, by = rows.readings.informative_mask(step.fit.shown), sensitivities(step.fit.model, rows.states)
    # A state far from its place hardly counted for the fit; whether it is one, usual errors of a place decide.
    usual = replace(scatter, state=scatter.state.clamp_min(scatter.tails.deviation**-2))
    whiten = Noise(rows, scatter.like, by, told, usual).whitener(step.whiten.doubt)
    residual, jacobian = whiten(step.fit.raw_residual), whiten(step.fit.raw_jacobian)
    columns = whiten(by[:, :, :2] * told[..., None])
    span = orthonormal(jacobian.flatten(0, 1)).reshape(len(rows), 2, -1)
    rest = residual - (span @ (span.flatten(0, 1).T @ residual.reshape(-1)))
    along = _sum(columns * rest[..., None], whiten.state, whiten.states)
    absorbed = torch.stack([_sum(span * columns[:, :, k, None], whiten.state, whiten.states) for k in (0, 1)], dim=1)
    size = _sum(columns.square(), whiten.state, whiten.states) - absorbed.square().sum(-1)
    move = -along / size.clamp_min(1e-300)
    gain = torch.where(size > 0, along.square() / size.clamp_min(1e-300), 0.0)
    misfit = _sum(rest.square()[..., None], whiten.state, whiten.states)
    telling = _sum((columns.abs().sum(-1) > 0).double()[..., None], whiten.state, whiten.states)
    typical = shared(scatter.like, bed) * scatter.position * scatter.tails.deviation
    stated = torch.minimum(shared(scatter.like, bed), typical)
    clear = (gain > LEAST + EACH * telling) & (gain > TAKES * misfit) & (move.abs() > FAR * stated)
    chosen = torch.nonzero(clear & (gain == gain.amax(1, keepdim=True)))
    if len(chosen) > max(1, int(MOST * whiten.states)):
        return []
    beyond = float(rest.square().sum()) - float(telling.sum())
    taken = float(gain[chosen[:, 0], chosen[:, 1]].sum())
    if lacking and (whiten.states < FEWEST or taken < MAIN * beyond):
        return []
    place = np.flatnonzero(kept)
    out = []
    for state, which in chosen.tolist():
        own = torch.nonzero(whiten.state == state)[:, 0]
        shown = float(rows.states.inputs()[which][own[0]])
        if bed.state[which] is ELONGATION:
            shown -= float(rows.states.reference_length[own[0]])
        where = tuple(int(p) for p in place[own.numpy()])
        sigmas = -float(torch.sign(move[state, which]) * gain[state, which].sqrt())
        expected = shown + float(move[state, which])
        slip = f"the place of this state: all of its {len(own)} rows agree if it was there"
        out.append(Suspect(where[0], bed.state[which].name, shown, expected, sigmas, slip, where))
    return sorted(out, key=lambda s: -abs(s.sigmas))


def _sum(each: Tensor, state: Tensor, states: int) -> Tensor:
    """Sum over the readings of each state: (N, 2, k) → (states, k)."""
    return torch.zeros(states, each.shape[-1], dtype=each.dtype).index_add_(0, state, each.sum(1))
