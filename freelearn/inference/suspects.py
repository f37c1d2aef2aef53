"""Readings that slipped, perhaps: which, by how much, and how it may have happened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from freelearn.inference.scatter import Scatter
from freelearn.inference.step import Step
from freelearn.measurements.rows import Rows
from freelearn.units import DEG, NMM

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
