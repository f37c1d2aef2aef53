"""What a hybrid model learns once its C1 and C2 are fitted: linear in its coefficients, and so in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.error import usual_scale
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.models.hybrid import Hybrid, alikeness, arms, potential_parts
from freelearn.physics.models.hybrid_shapes import SAME, coordinates, designs, distances, load_scale

# Most centers at a design, readings for each of them, and rows from which a design is learned at all.
CENTERS, READINGS_EACH, FEWEST = 250, 6, 20
# Widths of the Gaussian functions that are tried, in units of the box: of stretch, shear and pressure.
SPREADS = ((0.4, 0.25, 0.5), (0.7, 0.5, 0.7), (1.2, 0.8, 1.2), (2.0, 1.2, 2.0), (3.0, 2.0, 3.0))
# Ratios of noise to prior that are tried, relative to the largest eigenvalue.
RATIOS = torch.logspace(-10, 1, 45, dtype=torch.float64)
# Sizes that hysteresis and the sensors' gains are expected to have, beside the potential: hardly held back.
FREE, GAIN = 30.0, 1.0
# Columns of either.
RUBBING, SENSORS = slice(0, 2), slice(2, 6)
# Gain in log evidence below which nothing is learned of the potential.
WORTH = 3.0
# Rounds of reweighting, and standard deviations from which a reading counts for less (Huber 1964).
ROUNDS, HUBER = 3, 1.345
# Rows of either direction without which nothing is said of hysteresis.
BOTH_WAYS = 5
# Squared t from which an estimate is believed at all (positive-part shrinkage 1 − DOUBT/t²).
DOUBT = 4.0
# Share of hysteresis that one or two designs are believed to have in common with others, and those that three or more
# may show.
CARRIED, SHARES = 0.5, (0.0, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class _Learned:
    """At one design: box of its data, centers, widths and amplitudes [J] of its potential and its mean [J]; hysteresis
    in units of the design's loads (2,); the sensors' gains and cross-talk (2, 2)."""

    middle: Tensor
    half: Tensor
    center: Tensor
    spread: Tensor
    amplitude: Tensor
    level: Tensor
    rubbed: Tensor
    sensors: Tensor


@torch.no_grad()
def learn_remainder(model: Hybrid, rows: Rows) -> None:
    """Puts a remainder into a model whose parameters were fitted to these training rows."""
    model.clear()
    states = _acted(model, rows.states)
    place = designs(rows.states)
    groups = _groups(place)
    moduli = torch.tensor([model.scalars()[name] for name in ("C1", "C2")], dtype=torch.float64)
    box = _box(coordinates(states, moduli[0]))
    model.take({"moduli": moduli, "box": torch.stack(box)})
    loads, actuator = model(rows.states).loads, model.ideal(states, model.values()).loads
    counted = rows.readings.informative_mask(loads)
    scale = load_scale(rows.states, moduli, box[1])
    found, leaders, sizes = [], [], []
    for members in groups:
        parts = (part[members] for part in (loads, actuator, counted, scale))
        at = _Design(rows[members], states[members], moduli[0], *parts)
        if len(members) >= FEWEST:
            found.append(at.learn())
            leaders.append(place[members[0]])
            sizes.append(scale[members[0]])
    if found:
        model.take(_joined(torch.stack(leaders), found, torch.stack(sizes)))


def _acted(model: Hybrid, states: States) -> States:
    """The states that were really imposed on the actuator, as the model has them."""
    values = model.values()
    return model.imposed(model._shown(states, values).states, values) if model.effects else states


def _groups(place: Tensor) -> list[Tensor]:
    """Numbers of the rows of each design, in order of appearance; designs as near as SAME are one."""
    groups, left = [], torch.arange(len(place))
    while len(left):
        near = distances(place[left], place[left[:1]])[:, 0] <= SAME
        groups.append(left[near])
        left = left[~near]
    return groups


def _box(x: Tensor) -> tuple[Tensor, Tensor]:
    """Middle and half of the box that holds x (N, 3); of no width in a coordinate that is constant: some."""
    low, high = x.amin(0), x.amax(0)
    half = (high - low) / 2
    return (low + high) / 2, torch.where(half > 1e-9, half, torch.full_like(half, 0.01))


class _Design:
    """The rows of one design: what is lacking, and the columns that may explain it."""

    def __init__(
        self,
        rows: Rows,
        states: States,
        modulus: Tensor,
        loads: Tensor,
        actuator: Tensor,
        counted: Tensor,
        scale: Tensor,
    ) -> None:
        """loads: shown by the model before it learns, actuator: its own, both (N, 2); counted: readings, (N, 2) bool;
        scale: of the design's loads."""
        self.states, self.counted = states, counted
        x = coordinates(states, modulus)
        self.middle, self.half = _box(x)
        self.z = (x - self.middle) / self.half
        self.unit = usual_scale(rows.readings)
        self.actuator = actuator / self.unit
        self.lacking = torch.where(counted, -rows.readings.missed(loads) / self.unit, 0.0)
        told = [(states.direction * counted[:, 0] == way).sum() >= BOTH_WAYS for way in (-1.0, 1.0)]
        both = bool(torch.stack(told).all())
        rubbing = -states.direction[:, None] * scale / self.unit
        rubbing = rubbing if both else torch.zeros_like(rubbing)
        # (N, 2, 2): force and moment by the share of either.
        self.rubbing = torch.diag_embed(rubbing) * FREE
        count = min(CENTERS, int(counted.sum()) // READINGS_EACH)
        self.center = _farthest(self.z, count)

    def learn(self) -> _Learned:
        """The best of the widths, then reweighted."""
        target = self.lacking.reshape(-1)
        weight = self.counted.double().reshape(-1)
        trials = []
        for widths in SPREADS:
            spread = torch.tensor(widths, dtype=torch.float64)
            columns, unit = self._columns(spread)
            trials.append((_ridge(columns, target, weight), spread, columns, unit))
        best, spread, columns, unit = max(trials, key=lambda trial: trial[0].evidence)
        for _ in range(ROUNDS):
            left = (target - columns @ best.coefficients).reshape(-1, 2)
            best = _ridge(columns, target, weight * self._bounded(left).reshape(-1))
        believed = (1 - DOUBT / best.squared_t[RUBBING].clamp_min(1e-12)).clamp_min(0.0)
        amplitude = best.coefficients[6:] * unit
        height, _ = potential_parts(self.z, self.center, spread)
        gains = best.coefficients[SENSORS].reshape(2, 2) * GAIN * self.unit[:, None] / self.unit
        return _Learned(
            middle=self.middle,
            half=self.half,
            center=self.center,
            spread=spread,
            amplitude=amplitude,
            level=(height @ amplitude).mean(),
            rubbed=best.coefficients[RUBBING] * believed * FREE,
            sensors=gains,
        )

    def _columns(self, spread: Tensor) -> tuple[Tensor, Tensor]:
        """Columns (2N, 6 + B) of hysteresis, sensors and potential, and the amplitude of the latter's unit [J]."""
        _, slopes = potential_parts(self.z, self.center, spread)
        loads = -slopes * (arms(self.states) / self.half[:2])[:, None, :] / self.unit
        unit = 1 / loads.square().mean().sqrt().clamp_min(1e-300)
        columns = torch.cat([self.rubbing, self._sensors(self.actuator), loads.mT * unit], dim=-1).flatten(0, 1)
        return columns * self.counted.double().reshape(-1, 1), unit

    def _sensors(self, loads: Tensor) -> Tensor:
        """Of loads (N, 2) in their units: (N, 2, 4), what a gain of one shows more of force and moment."""
        none = torch.zeros_like(loads)
        return GAIN * torch.stack([torch.cat([loads, none], -1), torch.cat([none, loads], -1)], dim=1)

    def _bounded(self, left: Tensor) -> Tensor:
        """Huber's weights of what is left (N, 2), each channel on its own scale."""
        weights = torch.ones_like(left)
        for i in range(2):
            there = self.counted[:, i]
            if bool(there.any()):
                size = 1.4826 * left[there, i].abs().median() * HUBER
                weights[:, i] = size / left[:, i].abs().clamp_min(size.clamp_min(1e-300))
        return weights.clamp(max=1.0)


@dataclass(frozen=True)
class _Ridge:
    """coefficients (p,); squared_t: their squares over their variances, (p,); evidence: log marginal likelihood, but
    for a constant."""

    coefficients: Tensor
    squared_t: Tensor
    evidence: float


def _ridge(columns: Tensor, target: Tensor, weight: Tensor) -> _Ridge:
    """Ridge regression whose strength maximizes the marginal likelihood (MacKay 1992), by one decomposition.

    Hysteresis alone where the rest is not worth its freedom."""
    whole = _strengths(columns, target, weight)
    alone = _strengths(columns[:, RUBBING], target, weight)
    if whole.evidence >= alone.evidence + WORTH:
        return whole
    rest = torch.zeros(columns.shape[1] - 2, dtype=torch.float64)
    return _Ridge(torch.cat([alone.coefficients, rest]), torch.cat([alone.squared_t, rest]), alone.evidence)


def _strengths(columns: Tensor, target: Tensor, weight: Tensor) -> _Ridge:
    weighted = columns * weight[:, None]
    values, vectors = torch.linalg.eigh(columns.T @ weighted)
    values = values.clamp_min(0.0)
    along = vectors.T @ (weighted.T @ target)
    count = float((weight > 0).sum())
    total = (weight * target * target).sum()
    ratios = RATIOS * values.max().clamp_min(1e-300)
    held = values + ratios[:, None]
    cost = (total - (along.square() / held).sum(-1)).clamp_min(1e-12 * total.clamp_min(1e-300))
    evidence = -count / 2 * (cost / count).log() - ((held / ratios[:, None]).log()).sum(-1) / 2
    best = int(evidence.argmax())
    coefficients = vectors @ (along / held[best])
    variance = (vectors.square() / held[best]).sum(-1) * cost[best] / count
    return _Ridge(coefficients, coefficients.square() / variance.clamp_min(1e-300), float(evidence[best]))


def _farthest(z: Tensor, count: int) -> Tensor:
    """Points (count, 3) out of z, each as far from those before it as can be, the first nearest to the middle."""
    count = min(count, len(z))
    chosen = [int(z.square().sum(-1).argmin())]
    away = (z - z[chosen[0]]).square().sum(-1)
    for _ in range(count - 1):
        chosen.append(int(away.argmax()))
        away = torch.minimum(away, (z - z[chosen[-1]]).square().sum(-1))
    return z[chosen]


def _joined(design: Tensor, found: list[_Learned], size: Tensor) -> dict[str, Tensor]:
    """The buffers of a model, of what was found at each design. size: of its loads, (D, 2)."""
    most = max(len(f.center) for f in found)
    pad = [most - len(f.center) for f in found]
    far = distances(design, design) + torch.diag(torch.full((len(design),), math.inf, dtype=torch.float64))
    reach = (far.amin(-1) / 2).clamp(max=2 * SAME)
    rubbed = torch.stack([f.rubbed for f in found])
    carried = _carried(design, reach, rubbed)
    weights = alikeness(distances(design, design), reach, carried)
    return {
        "design": design,
        "reach": reach,
        "middle": torch.stack([f.middle for f in found]),
        "extent": torch.stack([f.half for f in found]),
        "center": torch.stack(
            [torch.nn.functional.pad(f.center, (0, 0, 0, n)) for f, n in zip(found, pad, strict=True)]
        ),
        "spread": torch.stack([f.spread for f in found]),
        "amplitude": torch.stack(
            [torch.nn.functional.pad(f.amplitude, (0, n)) for f, n in zip(found, pad, strict=True)]
        ),
        "level": torch.stack([f.level for f in found]),
        "sensors": torch.stack([f.sensors for f in found]),
        "rubbed": rubbed * size,
        "size": size,
        "weigher": torch.linalg.inv(weights),
        "carried": carried,
    }


def _carried(design: Tensor, reach: Tensor, rubbed: Tensor) -> Tensor:
    """The share of hysteresis that designs have in common: that by which each is told best from the others."""
    shares = [torch.tensor(share, dtype=torch.float64) for share in SHARES]
    if len(design) < 3:
        return torch.tensor(CARRIED, dtype=torch.float64)
    far = distances(design, design)
    # Each channel in its own size.
    each = rubbed / rubbed.square().mean(0).sqrt().clamp_min(1e-12)

    def missed(share: Tensor) -> float:
        weights = alikeness(far, reach, share)
        # Of a Gaussian process the residuals of leaving one out are (K⁻¹y)ᵢ / (K⁻¹)ᵢᵢ.
        inverse = torch.linalg.inv(weights)
        return float((inverse @ each / inverse.diagonal()[:, None]).square().sum())

    return min(shares, key=missed)
