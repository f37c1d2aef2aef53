"""What a researcher should know about fitted parameters: sentences for report, page and terminal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.fitting.options import PROFILE
from freelearn.fitting.uncertainty import Uncertainty, quantile
from freelearn.models.base import Model
from freelearn.results.formats import number

# Share of its usual size below which a positive parameter counts as gone.
VANISHED = 1e-8
# A correlation above this is worth a warning.
STRONG_CORRELATION = 0.95
# Standard errors larger than so many times the value tell nothing of a positive parameter.
UNTOLD = 10.0


def notes(model: Model[Any], start: Tensor) -> list[str]:
    """Sentences on physical parameters at a bound, or still where the fit began. start: raw vector (p,) before it."""
    said = []
    vector, physical = model.vector().detach(), model.scalars()
    lower, upper = model.raw_bounds()
    offset = len(vector) - len(model.declared)
    for i, name in enumerate(model.declared, offset):
        if model.declared[name].fixed:
            continue
        value = vector[i]
        reach = 1e-9 * max(1.0, float(value.abs()))
        if value - lower[i] <= reach or upper[i] - value <= reach:
            said.append(f"{name} is at its bound ({physical[name]:.6g} {model.declared[name].unit}).")
        elif model.declared[name].log and physical[name] < VANISHED * abs(model.declared[name].start):
            said.append(f"{name} has gone to zero: the rows ask for none of it.")
        elif torch.isclose(value, start[i], rtol=1e-7, atol=1e-12):
            said.append(f"{name} is still where the fit began: the rows may not depend on it.")
    return [*said, *model.remarks()]


def effect_notes(model: Model[Any], uncertainty: Uncertainty) -> list[str]:
    """Sentences on parameters of which the rows tell nothing, and on effects that they do not need, or cannot tell from
    something else."""
    place = {name: i for i, name in enumerate(uncertainty.names)}
    error = uncertainty.stderr
    said = _untold(model, uncertainty)
    correlation = correlations(uncertainty)
    reach = quantile(uncertainty.freedom)
    for name, spec in model.declared.items():
        i = place[name]
        profiled = uncertainty.kinds[i] == PROFILE
        if spec.none is None or not (profiled or math.isfinite(error[i])):
            continue
        inside = uncertainty.low[i] <= spec.none <= uncertainty.high[i]
        if inside if profiled else abs(uncertainty.values[i] - spec.none) < reach * error[i]:
            said.append(f"{name} is not significantly different from no effect: the rows do not ask for it.")
        twins = [n for n, j in place.items() if j != i and abs(correlation[i, j]) > STRONG_CORRELATION]
        if twins:
            said.append(f"{name} is strongly correlated with {', '.join(twins)}: these rows hardly tell them apart.")
    return said


def _untold(model: Model[Any], uncertainty: Uncertainty) -> list[str]:
    said = []
    told = zip(uncertainty.names, uncertainty.values, uncertainty.stderr, uncertainty.kinds, strict=True)
    for name, value, error, kind in told:
        spec = model.declared.get(name)
        # What has gone to zero is told of by itself.
        if spec is None or not spec.log or kind == PROFILE or value < VANISHED * abs(spec.start):
            continue
        if UNTOLD * value < error < math.inf:
            said.append(
                f"{name} = {number(value, 2)} {spec.unit} is not determined by these rows: its standard error is "
                f"{number(error / value, 2)} times as large."
            )
    return said


def interval_notes(uncertainty: Uncertainty) -> list[str]:
    """Sentences on profile intervals: of all of them, and of those parameters of which something should be known."""
    said = [f"{name}: {words}." for name, words in zip(uncertainty.names, uncertainty.words, strict=True) if words]
    return [*filter(None, [uncertainty.remark]), *said]


def correlations(uncertainty: Uncertainty) -> np.ndarray:
    """Correlation of the fitted parameters, (p, p); NaN where one is not determined."""
    error = uncertainty.stderr
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix: np.ndarray = uncertainty.covariance / np.outer(error, error)
    return matrix
