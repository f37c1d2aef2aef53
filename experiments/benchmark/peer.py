"""The search's peer: forward selection in sixty lines, plain SciPy over the public models.

Least squares at 1 % of the range with the parameters' priors; the states left out in turn decide. Nothing is known of
noise, of evidence, or of what may be claimed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from scipy.optimize import least_squares

from freelearn.data.rows import Rows
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.priors import raw_prior, spans

Array = np.ndarray[Any, Any]
Build = Callable[[Sequence[str]], Model]
# What a residual counts in [share of the range], by how much an effect has to lower the error, evaluations of a fit and
# of one that goes on from it, and how many candidates, the best on all rows, are fitted without each part.
OFF, LESS, MOST_FITTED, MOST_REFITTED, REFITTED = 0.01, 0.98, 30, 8, 6
# So many states are left out one by one; of more, six parts.
ONE_BY_ONE, PARTS = 10, 6


@dataclass(frozen=True)
class Chosen:
    """The effects beside those given, in the order in which they came; E of all rows and, where it was asked for, of
    those left out; x: the raw vector; model: fitted to all rows."""

    effects: list[str]
    E: float
    x: Array
    model: Model
    left_out: float = np.inf


def parts_of(rows: Rows) -> Array:
    """The part (n,) of each row: its state, or one of six parts of them; of one state every sixth row."""
    _, state = np.unique(rows.state, return_inverse=True)
    if state.max() == 0:
        return np.arange(len(state)) % PARTS
    return state if state.max() < ONE_BY_ONE else state % PARTS


class Fit:
    """Fits of a model to rows."""

    def __init__(self, model: Model, rows: Rows) -> None:
        self.model, self.rows, self.problem = model, rows, Problem(model, rows)
        prior = raw_prior(model, spans(rows))
        self.root, self.middle = prior.root.numpy(), prior.middle.numpy()
        self.low, self.high = (bound.numpy() for bound in model.raw_bounds())

    def missed(self, x: Array) -> Array:
        """Residuals (n, 2) in shares of the range."""
        with torch.no_grad():
            found = self.problem.residuals(torch.as_tensor(x)[None])[0].numpy().reshape(-1, 2)
        # Where there is no answer, zero is none.
        return np.where(np.isfinite(found), found, (self.rows.readings.value / self.problem.scale).numpy())

    def solved(self, start: Array, kept: Array, most: int) -> Array:
        """The raw vector fitted to the rows kept."""

        def residual(x: Array) -> Array:
            found: Array = np.r_[self.missed(x)[kept].ravel() / OFF, self.root @ (x - self.middle)]
            return found

        def jacobian(x: Array) -> Array:
            found = self.problem.jacobians(torch.as_tensor(x)[None])[0].numpy().reshape(len(kept), 2, -1)
            rates: Array = np.r_[np.nan_to_num(found[kept]).reshape(-1, len(x)) / OFF, self.root]
            return rates

        inside, bounds = np.clip(start, self.low, self.high), (self.low, self.high)
        how = {"x_scale": "jac", "ftol": 1e-4, "xtol": 1e-4, "max_nfev": most}
        found: Array = least_squares(residual, inside, jacobian, bounds=bounds, **how).x
        return found


def fitted(build: Build, rows: Rows, effects: Sequence[str], before: Chosen | None = None) -> Chosen:
    """The model with these effects fitted to all rows. before: to go on from."""
    model = build(effects)
    start = starts(model, rows, 1, torch.Generator().manual_seed(0))[0].numpy()
    if before is not None:
        known = dict(zip(before.model.labels(), before.x, strict=True))
        start = np.array([known.get(label, x) for label, x in zip(model.labels(), start, strict=True)])
    fit = Fit(model, rows)
    x = fit.solved(start, np.ones(len(rows), dtype=bool), MOST_FITTED)
    model.set_vector(torch.as_tensor(x))
    return Chosen(list(effects), _error(fit.missed(x)), x, model)


def refitted(chosen: Chosen, rows: Rows) -> Chosen:
    """The same with its error on parts that were left out of the fit in turn."""
    part, fit, missed = parts_of(rows), Fit(chosen.model, rows), np.zeros((len(rows), 2))
    for number in np.unique(part):
        x = fit.solved(chosen.x, part != number, MOST_REFITTED)
        missed[part == number] = fit.missed(x)[part == number]
    return replace(chosen, left_out=_error(missed))


def selected(build: Build, rows: Rows, library: Sequence[str]) -> Chosen:
    """Adds the effect that lowers the left-out error most, until none does by 2 %. build: effects → fresh model."""
    best = refitted(fitted(build, rows, []), rows)
    while left := [name for name in library if name not in best.effects]:
        tried = sorted((fitted(build, rows, [*best.effects, name], best) for name in left), key=lambda each: each.E)
        least = min((refitted(each, rows) for each in tried[:REFITTED]), key=lambda each: each.left_out)
        if least.left_out > LESS * best.left_out:
            break
        best = least
    return best


def _error(missed: Array) -> float:
    return float(np.sqrt((missed**2).sum() / len(missed)))
