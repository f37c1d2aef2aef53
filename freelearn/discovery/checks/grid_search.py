"""The best C1 and C2 of a table by a grid that zooms in: no derivative, no equilibrium, one batch after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Rows
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status

# Rows that a grid is looked at in, and one that is only looked through.
GRID_ROWS, FEW_ROWS = 24, 16
# Logarithms to ten of C1 and C2 [Pa] of the first grid. A zoom looks about so many of its best places, each at so many
# by either axis, half as far apart: where fibers bear the most, what fits lies in a narrow valley.
DECADES = torch.linspace(4, 8, 9, dtype=torch.float64)
BEAM = 3
ABOUT = torch.tensor([-1.0, -0.5, 0.0, 0.5, 1.0], dtype=torch.float64)
# Share of the residuals, the largest ones, that an error does without: some readings slip.
TRIMMED = 0.03
# A miss is counted as so many times the usual reading at most; a place that nothing holds as that many times.
WORST, LOOSE = 10.0, 1.0
# Steps by which stiffness is taken, as a share of the length and in radians.
STEP_LENGTH, STEP_TWIST = 1e-4, 1e-4
LN10 = math.log(10.0)


@dataclass(frozen=True)
class Found:
    """The best place of a grid. E and channels: as in PlainFit. answered: share of the rows with loads. vector: raw
    (p,)."""

    E: float
    channels: tuple[float, float]
    answered: float
    vector: Tensor


def thinned(rows: Rows, most: int) -> Rows:
    """Evenly spread, so many at most."""
    count = len(rows)
    return rows if count <= most else rows[torch.linspace(0, count - 1, most, dtype=torch.float64).round().long()]


def gridded(model: Model, rows: Rows, zooms: int) -> Found:
    """The best of a grid over the model's C1 and C2, its other parameters as they start, zoomed in so many times.

    Under a dead load the loads at the places that were measured are compared with those that hang, and turned into
    places by the model's own stiffness there; where that holds nothing, the place counts as missed by a whole range.
    """
    rows = thinned(rows, GRID_ROWS if zooms > 1 else FEW_ROWS)
    scale = usual(rows)
    axes = [model.labels().index(name) for name in ("C1", "C2")]
    places, apart = torch.cartesian_prod(DECADES, DECADES), float(DECADES[1] - DECADES[0])
    found: list[tuple[float, Tensor, Tensor, float]] = []
    for _ in range(zooms + 1):
        vectors = model.vector().detach().expand(len(places), -1).clone()
        vectors[:, axes] = places * LN10
        channels, answered = _misses(model, rows, vectors, scale)
        E = channels.square().nansum(1).sqrt()
        found += [(float(E[k]), vectors[k], channels[k], float(answered[k])) for k in E.argsort()[:BEAM].tolist()]
        found = sorted(found, key=lambda each: each[0])[:BEAM]
        middles = torch.stack([vector[axes] / LN10 for _, vector, _, _ in found])
        about = torch.cartesian_prod(ABOUT, ABOUT) * apart
        places, apart = (middles[:, None] + about).flatten(0, 1).unique(dim=0), apart / 2
    best, vector, pair, share = found[0]
    return Found(best, (float(pair[0]), float(pair[1])), share, vector)


def usual(rows: Rows) -> Tensor:
    """Size of the largest readings of either channel but for a few, (2,) SI; one where there are none."""
    sizes = []
    for value, there in zip(rows.readings.value.T, rows.readings.present.T, strict=True):
        size = value[there].abs().quantile(1 - TRIMMED) if there.any() else torch.ones((), dtype=torch.float64)
        sizes.append(size if size > 0 else torch.ones((), dtype=torch.float64))
    return torch.stack(sizes)


def shares(missed: Tensor, rows: Rows) -> Tensor:
    """Root mean square of misses (…, N, 2), shares of the usual readings, without the largest: (…, 2); NaN where
    nothing was read."""
    out = []
    for number, there in enumerate(rows.readings.present.T):
        sizes = missed[..., there, number].abs().nan_to_num(WORST, WORST).clamp_max(WORST).sort(dim=-1).values
        kept = sizes[..., : max(1, round(sizes.shape[-1] * (1 - TRIMMED)))]
        empty = torch.full(sizes.shape[:-1], torch.nan, dtype=torch.float64)
        out.append(kept.square().mean(-1).sqrt() if sizes.shape[-1] else empty)
    return torch.stack(out, dim=-1)


def _misses(model: Model, rows: Rows, vectors: Tensor, scale: Tensor) -> tuple[Tensor, Tensor]:
    """Errors of both channels of every raw vector (k, p), (k, 2), and the share of rows with loads, (k,)."""
    count, seen = len(vectors), rows.as_loads
    row = torch.arange(len(rows)).repeat(count)
    values = model.physical(vectors.repeat_interleave(len(rows), dim=0))
    states = seen.states[row].replace(near=None)

    def loads(length: float = 0.0, twist: float = 0.0) -> tuple[Tensor, Tensor]:
        at = states.replace(length=states.length + length * states.reference_length, twist=states.twist + twist)
        predicted = model.chain(at, values)
        return predicted.loads, predicted.status == Status.OK

    with torch.no_grad():
        shown, good = loads()
        missed = seen.readings[row].missed(shown)
        if rows.states.bed is DEAD_LOAD:
            by_length = (loads(length=STEP_LENGTH)[0] - shown) / STEP_LENGTH / states.reference_length[:, None]
            by_twist = (loads(twist=STEP_TWIST)[0] - shown) / STEP_TWIST
            missed = _moved(missed, torch.stack([by_length, by_twist], dim=-1), scale)
    missed = torch.where(good[:, None], missed / scale, torch.nan)
    # A row without an answer is missed by a whole range, or a model could choose what to answer.
    missed = missed.nan_to_num(LOOSE, WORST, -WORST).reshape(count, len(rows), 2)
    return shares(missed, rows), good.reshape(count, -1).double().mean(1)


def _moved(missed: Tensor, slope: Tensor, scale: Tensor) -> Tensor:
    """Misses of the place (n, 2) that misses of the loads (n, 2) make, by their slope (n, 2, 2); a whole range where
    the tube would drive itself on."""
    a, b, c, d = slope[:, 0, 0], slope[:, 0, 1], slope[:, 1, 0], slope[:, 1, 1]
    determinant = a * d - b * c
    held = (determinant > 0) & (a < 0) & (d < 0)
    safe = torch.where(held, determinant, 1.0)
    # The place at which the loads would be those that hang: x − x₀ = −S⁻¹ (F(x₀) − F).
    length = -(d * missed[:, 0] - b * missed[:, 1]) / safe
    twist = -(a * missed[:, 1] - c * missed[:, 0]) / safe
    place = torch.stack([length, twist], dim=-1)
    return torch.where(held[:, None], place, LOOSE * scale)
