"""Two looks at the residuals that need no candidate, and what they rule out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.stats import f as f_distribution
from torch import Tensor

from freelearn.inference.noise import Whitener
from freelearn.inference.structure import _scaled, clear, monomials, orthonormal, whitened_basis
from freelearn.measurements.states import States
from freelearn.units import NMM

# A screen that would look like this less often than once in a hundred times speaks.
ALPHA = 0.01
POTENTIAL_DEGREE, LOAD_DEGREE = 5, 4


@dataclass(frozen=True)
class Screen:
    """p_value: chance that noise alone would look like this; None where the rows cannot tell. says: in words."""

    name: str
    p_value: float | None
    says: str


def rising_falling(raw: Tensor, states: States, state: np.ndarray, whiten: Whitener) -> Screen:
    """Residuals at falling against rising pressure, at the same pressure of the same kinematic state.

    raw: predicted − measured (N, 2). What a row's state and pressure decide cancels in the difference, a position
    error included, so only what depends on the history can show.
    """
    name = "rising against falling pressure"
    pressure, direction = states.pressure.numpy(), states.direction.numpy()
    noise = torch.stack([whiten.force, (whiten.moment**2 + whiten.slant**2).sqrt()], -1).numpy()
    residual, differences, weights, places = raw.numpy(), [], [], []
    order = np.argsort(state, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(state[order])) + 1):
        falling = rows[direction[rows] < 0]
        rising = rows[direction[rows] >= 0]
        if not len(falling) or len(rising) < 2:
            continue
        rising = rising[np.argsort(pressure[rising])]
        inside = (pressure[falling] >= pressure[rising[0]] - 500) & (pressure[falling] <= pressure[rising[-1]] + 500)
        for row in falling[inside]:
            smooth = [np.interp(pressure[row], pressure[rising], residual[rising, k]) for k in range(2)]
            differences.append((residual[row] - smooth) / noise[row])
            weights.append(noise[row])
            places.append(row)
    if len(differences) < 10:
        return Screen(
            name, None, "too few falling-pressure rows beside rising ones: history effects cannot be seen here"
        )
    z, at = np.array(differences), states[torch.as_tensor(np.array(places))]
    basis = orthonormal(monomials(at, 1)[0]).numpy()
    p_values = []
    for k in range(2):
        explained = ((basis.T @ z[:, k]) ** 2).sum()
        freedom = len(z) - basis.shape[1]
        rest = max((z[:, k] ** 2).sum() - explained, 1e-300) / freedom
        p_values.append(float(f_distribution.sf(explained / basis.shape[1] / rest, basis.shape[1], freedom)))
    p_value = min(1.0, 2 * min(p_values))
    force, moment = (z * np.array(weights)).mean(0)
    if p_value < ALPHA:
        says = (
            f"loads differ between falling and rising pressure (by {-force:+.3g} N and {-moment / NMM:+.3g} N·mm on "
            "average, measured): friction_hysteresis, relaxation or stress_softening takes part"
        )
    else:
        says = "no difference beyond the noise: nothing speaks for friction_hysteresis, relaxation or stress_softening"
    return Screen(name, p_value, says)


def reciprocity(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> Screen:
    """Whether the residuals can come from a potential, ∂F/∂φ = ∂M/∂l at fixed pressure.

    residual (N, 2) and jacobian (N, 2, p): whitened. Polynomial loads that derive from a potential U(l, φ, P) are
    fitted first; an F-test asks whether free polynomials explain more.
    """
    name = "reciprocity"
    samples = torch.unique(states.sample)
    absorbed = orthonormal(jacobian.flatten(0, 1))
    flat = residual.reshape(-1)
    potential = torch.cat([_gradients(states, states.sample == n) for n in samples], dim=2)
    free = torch.cat([monomials(states, LOAD_DEGREE)[0] * (states.sample == n)[:, None] for n in samples], dim=1)
    conservative = orthonormal(clear(whiten(potential).flatten(0, 1), absorbed))
    extra = orthonormal(clear(clear(whitened_basis(free, whiten), absorbed), conservative))
    freedom = len(flat) - absorbed.shape[1] - conservative.shape[1] - extra.shape[1]
    if freedom < 20 or not extra.shape[1]:
        return Screen(name, None, "too few rows to test reciprocity")
    explained = float((extra.T @ flat).square().sum())
    kept = float((conservative.T @ flat).square().sum())
    rest = max(float(flat.square().sum()) - explained - kept, 1e-300) / freedom
    p_value = float(f_distribution.sf(explained / extra.shape[1] / rest, extra.shape[1], freedom))
    if p_value < ALPHA:
        says = (
            "the residuals break ∂F/∂φ = ∂M/∂l: no energy, geometry or boundary effect alone explains them; a sensor "
            "error, friction or another history effect takes part"
        )
    else:
        says = "the residuals keep ∂F/∂φ = ∂M/∂l: nothing in them speaks for a sensor error or friction"
    return Screen(name, p_value, says)


def _gradients(states: States, mask: Tensor) -> Tensor:
    """(∂U/∂l, ∂U/∂φ) of the monomials U of length, twist and pressure on the rows of the mask, (N, 2, k)."""
    x, y, z = (_scaled(v) for v in (states.length - states.reference_length, states.twist, states.pressure))
    change = states.length - states.reference_length
    x_rate = 2 / float((change.max() - change.min()).clamp_min(1e-12))
    y_rate = 2 / float((states.twist.max() - states.twist.min()).clamp_min(1e-12))
    columns = []
    for i in range(POTENTIAL_DEGREE + 1):
        for j in range(POTENTIAL_DEGREE + 1 - i):
            for k in range(min(LOAD_DEGREE, POTENTIAL_DEGREE - i - j) + 1):
                if i + j == 0:
                    continue
                along = i * x ** max(i - 1, 0) * y**j * z**k * x_rate
                around = j * x**i * y ** max(j - 1, 0) * z**k * y_rate
                columns.append(torch.stack([along, around], dim=1) * mask[:, None])
    return torch.stack(columns, dim=-1)
