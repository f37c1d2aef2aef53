"""Do loads differ between rising and falling pressure? A screen for what depends on the history."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.states import States, noise_band
from freelearn.discovery.noise.linear_algebra import Shared, orthonormal
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.noise.shapes import monomials
from freelearn.discovery.noise.structure import ALPHA, ResidualTest, f_test

NAME = "rising against falling pressure"
# Why nothing can be compared on an end block.
ALONE = "no two rows differ by their direction alone"
# Fewer comparisons show nothing.
FEWEST_COMPARISONS = 6
# Chance of not having slipped above which a reading is compared.
PROBABLY = 0.5
# A falling row is compared where rising ones of its state surround it, up to this much [Pa].
BEYOND = 500.0
# Two-sided quantile of the normal distribution for the largest difference that may have been missed: 99 %.
QUANTILE = 2.58


@dataclass(frozen=True)
class Comparison:
    """A falling row and the two or three rising rows of its state that its loads are interpolated between."""

    falling: int
    rising: np.ndarray
    share: np.ndarray


def comparisons(states: States, state: np.ndarray) -> list[Comparison]:
    """Every row of falling pressure with rising rows of the same kinematic state on both sides.

    state: number of each row's kinematic state, (N,). Between the rising rows a load is a parabola where there are
    three of them, so that its bend is not mistaken for hysteresis. None where several actuators share an end block:
    what one pressure decides cannot be told from the others."""
    if states.members:
        return []
    pressure, direction = states.pressure.numpy(), states.direction.numpy()
    apart, out = noise_band(pressure), list[Comparison]()
    order = np.argsort(state, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(state[order])) + 1):
        falling, rising = rows[direction[rows] < 0], rows[direction[rows] >= 0]
        rising = rising[np.argsort(pressure[rising], kind="stable")]
        if len(rising) < 2:
            continue
        for row in falling:
            if pressure[rising[0]] - BEYOND <= pressure[row] <= pressure[rising[-1]] + BEYOND:
                nearest = _nearest(pressure[rising], float(pressure[row]), apart)
                out.append(Comparison(int(row), rising[nearest], _shares(pressure[rising[nearest]], pressure[row])))
    return out


def _nearest(at: np.ndarray, where: float, apart: float) -> np.ndarray:
    """Numbers of the three nearest of values `at`, of several less than so far apart the nearest alone: between what
    noise alone tells apart nothing can be interpolated."""
    chosen: list[int] = []
    for i in np.argsort(np.abs(at - where), kind="stable"):
        if all(abs(at[i] - at[j]) >= apart for j in chosen):
            chosen.append(int(i))
        if len(chosen) == 3:
            break
    return np.array(chosen)


def _shares(at: np.ndarray, where: float) -> np.ndarray:
    """Lagrange's weights of values at `at` for the value at `where`."""
    shares = np.ones(len(at))
    for i in range(len(at)):
        for j in range(len(at)):
            if i != j:
                shares[i] *= (where - at[j]) / (at[i] - at[j])
    return shares


def rising_falling(raw: Tensor, states: States, state: np.ndarray, whiten: Whitener) -> ResidualTest:
    """Residuals at falling against rising pressure, at the same pressure of the same kinematic state.

    raw: predicted − measured (N, 2). What a row's state and pressure decide cancels in the difference, a position
    error included, so only what depends on the history can show. Readings that slipped show nothing, nor do blank ones
    and those of a tube that hangs loose (whiten.told).
    """
    if states.members:
        return ResidualTest(NAME, None, None, f"on one end block {ALONE}")
    pairs = comparisons(states, state)
    if whiten.scatter is not None:
        right = (whiten.scatter.good > PROBABLY).all(-1).numpy()
        pairs = [p for p in pairs if right[p.falling] and right[p.rising].all()]
    seen = whiten.told.numpy()
    there = np.array([seen[p.falling] & seen[p.rising].all(axis=0) for p in pairs]).reshape(-1, 2)
    readings = enumerate(states.bed.readings)
    enough = there.sum(0) >= FEWEST_COMPARISONS
    told = [i for i, quantity in readings if quantity in states.bed.measured and enough[i]]
    if not told:
        few = "too few falling-pressure rows beside rising ones to compare"
        return ResidualTest(NAME, None, None, few)
    noise = whiten.own.numpy()
    place = np.array([pair.falling for pair in pairs])
    difference = _differences(pairs, raw.numpy())
    # A model that has run away may have a noise in its place whose square is beyond every number: as good as unread.
    with np.errstate(over="ignore", invalid="ignore"):
        spread = np.array([np.sqrt(noise[p.falling] ** 2 + p.share**2 @ noise[p.rising] ** 2) for p in pairs])
    spread = np.nan_to_num(spread, nan=np.inf)

    # What the rows of a level err by alike stands in all differences from it.
    levels = torch.as_tensor(_differences(pairs, whiten.alike.numpy()))

    def chance(i: int) -> float:
        both = torch.as_tensor(there[:, i])
        unit = torch.as_tensor(spread)[both, i, None]
        shared = Shared.of((levels[both, i] / unit).nan_to_num())
        basis = orthonormal(shared.apart(monomials(states[torch.as_tensor(place)[both]], 1)[0]))
        z = shared.apart(torch.as_tensor(difference)[both, i, None] / unit)
        return _p_value(z[:, 0].numpy(), basis.numpy())

    p_value = min(1.0, len(told) * min(map(chance, told)))
    compared = [difference[there[:, i], i] for i in told]
    mean = np.zeros(2)
    mean[told] = [values.mean() for values in compared]

    def amounts(sizes: np.ndarray, form: str) -> str:
        shown = [(sizes[i] / states.bed.readings[i].factor, states.bed.readings[i].suffix) for i in told]
        return " and ".join(f"{size:{form}}{unit}" for size, unit in shown)

    if p_value < ALPHA:
        what = "loads differ" if states.bed.loads else "readings differ"
        says = (
            f"{what} between falling and rising pressure (by {amounts(-mean, '+.3g')} on average, measured): "
            "friction_hysteresis, pressure_hysteresis, relaxation or stress_softening takes part"
        )
        return ResidualTest(NAME, True, p_value, says)
    most = np.zeros(2)
    most[told] = [abs(v.mean()) + QUANTILE * v.std(ddof=1) / np.sqrt(len(v)) for v in compared]
    says = f"no difference beyond the noise; on average it is at most {amounts(most, '.2g')}"
    if states.bed.loads:
        says += ", so friction_hysteresis is at most half of that"
    return ResidualTest(NAME, False, p_value, says, (float(most[0]), float(most[1])))


def _differences(pairs: Sequence[Comparison], values: np.ndarray) -> np.ndarray:
    """Values (N, …) of falling rows less what rising ones have at their pressure, (pairs, …)."""
    return np.array([values[p.falling] - np.tensordot(p.share, values[p.rising], 1) for p in pairs])


def _p_value(z: np.ndarray, basis: np.ndarray) -> float:
    """F-test of differences z (n,) for a part along an orthonormal basis (n, k)."""
    explained = float(((basis.T @ z) ** 2).sum())
    freedom = len(z) - basis.shape[1]
    if freedom < 1:
        return 1.0
    rest = max(float((z**2).sum()) - explained, 1e-300) / freedom
    return f_test(explained / basis.shape[1] / rest, basis.shape[1], freedom)
