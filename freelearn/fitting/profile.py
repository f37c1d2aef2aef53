"""Profile-likelihood intervals of fitted physical parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from freelearn.fitting.lifted import lifted
from freelearn.fitting.options import PROFILE
from freelearn.fitting.problem import Problem
from freelearn.fitting.profile_end import LOWER, SAME, BetterFitError
from freelearn.fitting.profile_line import Spot, Squares
from freelearn.fitting.profile_parameter import FAINT, Interval, ParameterProfile, line_of
from freelearn.fitting.profile_scale import allowances, gone
from freelearn.fitting.profile_words import EXACT, NETWORK, SEVERAL, SHARED, WEIGHTS, beside, elsewhere
from freelearn.fitting.uncertainty import Uncertainty, as_fitted
from freelearn.models.base import Model

# Told of a parameter whose ends are being looked for: its name, how many ends are known, and of how many.
Told = Callable[[str, int, int], None]

# How many times a better fit, met by a profile, becomes the minimum that the profiles are about.
MOST_BEGINNINGS = 3
# Residuals (readings divided by the largest) whose root mean square is less than this are rounding.
ROUNDING = 1e-9


def profiled(problem: Problem, known: Uncertainty, told: Told | None = None) -> Uncertainty:
    """`known` with profile intervals of the physical parameters in the place of the normal ones.

    problem: the rows of the fit, its model at the fitted parameters, which stay as they are. The profile is of the sum
    of squares that the fit minimized: for each value of a parameter the least sum over all others. Its interval holds
    the values at which that sum is above the minimum by no more than profile_scale.allowances gives. So it knows the
    bounds, is asymmetric where the model is, and is the same in whatever form a parameter is fitted (Bates & Watts
    1988, chapter 6; Venzon & Moolgavkar 1988). An end that the rows do not tell is infinite, or the bound, and words
    say so; where a search does not come to an end, words say so and the normal interval stays.
    """
    problem = as_fitted(problem)
    model = problem.model
    if not model.declared:
        return replace(known, remark=WEIGHTS)
    if model.needs_validation:
        return replace(known, remark=NETWORK)
    squares = Squares.of(problem)
    start = model.vector().detach()
    for _ in range(MOST_BEGINNINGS):
        try:
            return _about(_minimum(model, squares, start), problem, squares, known, told)
        except BetterFitError as found:
            start = found.vector
    return replace(known, remark=SEVERAL)


def _minimum(model: Model[Any], squares: Squares, start: Tensor) -> Tensor:
    """The raw vector (p,) of the least sum of squares near a start: the start itself where it is as good."""
    found = [(squares.at(start), start)]
    for vector in (start, lifted(model, start)):
        result = squares.least(vector)
        if float(result.loss) < (1 - SAME) * found[-1][0]:
            found.append((float(result.loss), result.x))
    return found[-1][1]


def _about(vector: Tensor, problem: Problem, squares: Squares, known: Uncertainty, told: Told | None) -> Uncertainty:
    """The intervals about a minimum (p,). Raises BetterFitError where that is none."""
    model = problem.model
    fitted = model.vector().detach()
    loss = squares.at(vector)
    lines = {name: line_of(model, name, vector) for name, p in model.declared.items() if not p.fixed}
    allowed = allowances(problem, vector, [line.slope(vector) for line in lines.values()], known.freedom)
    # A search that goes on from where something has gone to nothing cannot find it again.
    wary = bool(gone(problem, vector, problem.jacobians(vector[None])[0].norm(dim=0)).any())
    nothing = ROUNDING**2 * known.residuals
    least, most = (choose(allowance.rise for allowance in allowed) for choose in (min, max))
    if most <= max(nothing, FAINT * loss):
        return replace(known, remark=EXACT if loss <= nothing else SHARED)
    values = {name: float(value) for name, value in _scalars(model, vector).items()}
    if known.chi_square - loss > most:
        return replace(known, remark=elsewhere(known.chi_square, loss, values))
    found: dict[str, Interval] = {}
    for (name, line), allowance in zip(lines.items(), allowed, strict=True):
        done = 2 * len(found)

        def tell(ends: int, name: str = name, done: int = done) -> None:
            if told:
                told(name, done + ends, 2 * len(lines))

        center = Spot(line.place(vector), loss, vector, True)
        profile = ParameterProfile(problem, squares, line, name, center, line.place(fitted), allowance, wary)
        found[name] = profile.interval(tell)
    remark = beside(known.chi_square, loss, values) if known.chi_square - loss > LOWER * least else ""
    return _joined(known, found, remark)


def _scalars(model: Model[Any], vector: Tensor) -> dict[str, Tensor]:
    with torch.no_grad():
        values = model.physical(vector)
    return {name: values[name] for name in model.declared}


def _joined(known: Uncertainty, found: dict[str, Interval], remark: str) -> Uncertainty:
    """The intervals that were found in the place of the normal ones."""
    low, high = known.low.copy(), known.high.copy()
    kinds, words = list(known.kinds), list(known.words)
    for name, interval in found.items():
        i = known.names.index(name)
        words[i] = interval.words
        if not math.isnan(interval.low):
            low[i], high[i], kinds[i] = interval.low, interval.high, PROFILE
    return replace(known, low=low, high=high, kinds=kinds, words=words, remark=remark)
