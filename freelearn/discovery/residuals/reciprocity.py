"""Do the residuals come from a potential? A screen for what no energy, geometry or boundary effect can do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.beds import FORCE, MOMENT
from freelearn.data.states import States
from freelearn.discovery.noise.linear_algebra import clear, orthonormal, summed_products
from freelearn.discovery.noise.noise import Whitener, whitened_basis
from freelearn.discovery.noise.shapes import bins, both_loads, elongation, monomials, rows_of_samples, scaled
from freelearn.discovery.noise.structure import ALPHA, ResidualTest, f_test

NAME = "reciprocity"
# Degrees of the polynomial potentials, of pressure in them and in the bins, and of the free loads.
POTENTIAL_DEGREE, PRESSURE_DEGREE, LOAD_DEGREE = 6, 4, 3
BIN_DEGREE = 2
# Most bins of length and of twist for a sample: the paper's bed has 11 and 26 levels.
MOST_BINS = 30
FEWEST_FREE = 100
DRAWS = 999
# Residuals are said to keep the law if less than this share of what is systematic in them can break it, and to break it
# only if more than that share does: of a large misfit, a little is always left that the potentials could not follow.
BROKEN_AT_MOST, BROKEN_AT_LEAST = 0.1, 0.01
# One-sided quantile of the normal distribution for the largest share that can break it: 99 %.
QUANTILE = 2.33


def reciprocity(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> ResidualTest:
    """Whether the residuals can come from a potential, ∂F/∂φ = ∂M/∂l at fixed pressure.

    residual (N, 2) and jacobian (N, 2, p): whitened. Loads that derive from a potential are fitted first: polynomials
    U(l, φ, P), and any moment that twist and pressure decide alone, any force that length and pressure decide alone,
    which have one however they ripple. Then it is asked whether free polynomials explain more than chance: by an
    F-test, and by flipping the signs of whole kinematic states, since what the potentials could not follow is common to
    the rows of a state. Both have to agree.
    """
    if states.bed.measured != (FORCE, MOMENT):
        return ResidualTest(
            NAME, None, None, "this bed does not measure force and moment, which reciprocity ties together"
        )
    parts = [_examine(residual, jacobian, states, whiten, rows) for rows in rows_of_samples(states)]
    freedom, rank = sum(p.freedom for p in parts), sum(p.extra for p in parts)
    if freedom < FEWEST_FREE or not rank:
        return ResidualTest(NAME, None, None, "too few rows to test reciprocity")
    kept, broken, left = sum(p.kept for p in parts), sum(p.broken for p in parts), sum(p.left for p in parts)
    variance = max(left, 1e-300) / freedom
    flipped = float((1 + (np.sum([p.flipped for p in parts], axis=0) >= broken).sum()) / (DRAWS + 1))
    p_value = max(f_test(broken / rank / variance, rank, freedom), flipped)
    systematic = max(broken - rank * variance, 0.0)
    whole = kept - sum(p.conservative for p in parts) * variance + systematic
    if p_value < ALPHA and systematic > BROKEN_AT_LEAST * whole:
        return ResidualTest(
            NAME,
            True,
            p_value,
            "the residuals break ∂F/∂φ = ∂M/∂l: no energy, geometry or boundary effect alone explains them; a sensor "
            "error, friction or another history effect takes part",
        )
    most = systematic + QUANTILE * (2 * rank * variance**2 + 4 * systematic * variance) ** 0.5
    if most < BROKEN_AT_MOST * whole:
        return ResidualTest(
            NAME,
            False,
            p_value,
            f"the residuals keep ∂F/∂φ = ∂M/∂l, but for {100 * most / whole:.2g} % of what is systematic at most: an "
            "energy, geometry or boundary effect, or a zero offset, may explain them",
        )
    return ResidualTest(NAME, None, None, "the residuals cannot tell whether ∂F/∂φ = ∂M/∂l is broken")


@dataclass(frozen=True)
class _Part:
    """One sample's residuals: dimensions of the conservative loads, of the extra ones and of the rest; χ² explained by
    the conservative ones (kept), by the extra ones (broken) and by neither (left); broken with signs flipped, (DRAWS,).
    """

    conservative: int
    extra: int
    freedom: int
    kept: float
    broken: float
    left: float
    flipped: np.ndarray


def _examine(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener, rows: Tensor) -> _Part:
    """One sample alone, as if the fit's parameters were its own: what they absorb is taken off first."""
    part, own = whiten.part(rows), states[rows]
    absorbed = orthonormal(jacobian[rows].flatten(0, 1))
    flat = residual[rows].reshape(-1)
    flat = flat - absorbed @ (absorbed.T @ flat)
    potentials = torch.cat([_gradients(own), _alone(own)], dim=2)
    conservative = orthonormal(clear(part(potentials).flatten(0, 1), absorbed))
    loads = clear(whitened_basis(monomials(own, LOAD_DEGREE)[0], part), absorbed)
    extra = orthonormal(clear(loads, conservative))
    along, across = conservative.T @ flat, extra.T @ flat
    kept, broken = float(along.square().sum()), float(across.square().sum())
    freedom = part.count - absorbed.shape[1] - conservative.shape[1] - extra.shape[1]
    left = float(flat.square().sum()) - kept - broken
    flipped = _flipped(extra, flat - conservative @ along, part)
    return _Part(conservative.shape[1], extra.shape[1], freedom, kept, broken, left, flipped)


def _flipped(extra: Tensor, rest: Tensor, whiten: Whitener) -> np.ndarray:
    """What would be explained if the signs of whole kinematic states were at random, (DRAWS,)."""
    each = summed_products(extra, rest, whiten.state, whiten.states)
    signs = torch.as_tensor(np.random.default_rng(23).choice([-1.0, 1.0], size=(DRAWS, whiten.states)))
    drawn: np.ndarray = (signs @ each).square().sum(1).numpy()
    return drawn


def _alone(states: States) -> Tensor:
    """Forces that length and pressure decide, and moments that twist and pressure decide, (N, 2, k)."""
    pressure = scaled(states.pressure)[:, None]
    force, moment = (
        torch.cat([bins(x, MOST_BINS) * pressure**k for k in range(BIN_DEGREE + 1)], dim=1)
        for x in (elongation(states), states.twist)
    )
    return both_loads(force, moment)


def _gradients(states: States) -> Tensor:
    """(∂U/∂l, ∂U/∂φ) of the monomials U of length, twist and pressure, (N, 2, k)."""
    change = elongation(states)
    x, y, z = (scaled(v) for v in (change, states.twist, states.pressure))
    x_rate = 2 / float((change.max() - change.min()).clamp_min(1e-12))
    y_rate = 2 / float((states.twist.max() - states.twist.min()).clamp_min(1e-12))
    columns = []
    for i in range(POTENTIAL_DEGREE + 1):
        for j in range(POTENTIAL_DEGREE + 1 - i):
            for k in range(min(PRESSURE_DEGREE, POTENTIAL_DEGREE - i - j) + 1):
                if i + j == 0:
                    continue
                along = i * x ** max(i - 1, 0) * y**j * z**k * x_rate
                around = j * x**i * y ** max(j - 1, 0) * z**k * y_rate
                columns.append(torch.stack([along, around], dim=1))
    return torch.stack(columns, dim=-1)
