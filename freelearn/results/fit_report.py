"""The fit report, in the form that lmfit users know."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from freelearn.fit.uncertainty import Uncertainty
from freelearn.models.base import Model

# A 95 % interval is this many standard errors to each side (the rows are many: the normal quantile).
INTERVAL = 1.959964
# Share of its usual size below which a positive parameter counts as gone.
VANISHED = 1e-8
# A correlation above this is worth a warning.
STRONG_CORRELATION = 0.95
SHOW_CORRELATION = 0.1


def fit_report(
    model: Model,
    found: Uncertainty,
    start: Tensor,
    method: str,
    message: str,
    epochs: int,
    counts: dict[str, int],
) -> str:
    """Text with statistics, values ± standard errors, 95 % intervals, correlations and warnings.

    start: the raw vector (p,) before the fit, to tell parameters that never moved.
    """
    parts = [
        _statistics(model, found, method, message, epochs, counts),
        _variables(model, found),
        _correlations(found),
        _warnings(model, found, start),
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _statistics(
    model: Model, found: Uncertainty, method: str, message: str, epochs: int, counts: dict[str, int]
) -> str:
    n, p, chi2 = found.residuals, len(found.values), found.chi_square
    per_residual = n * math.log(chi2 / n) if chi2 > 0 else -math.inf
    rows = [
        ("fitting method", method),
        ("outcome", message),
        ("# epochs", epochs),
        ("# data points", f"{n} (force and moment of {n // 2} rows)"),
        ("# variables", p),
        ("chi-square", f"{chi2:.8g}"),
        ("reduced chi-square", f"{chi2 / max(n - p, 1):.8g}"),
        ("Akaike info crit", f"{per_residual + 2 * p:.8g}"),
        ("Bayesian info crit", f"{per_residual + math.log(n) * p:.8g}"),
        *((f"rows {name}", count) for name, count in counts.items()),
    ]
    lines = [
        f"[[Model]]\n    {model.name}" + "".join(f" + {e.name}" for e in model.effects),
        "[[Fit Statistics]]",
    ]
    lines += [f"    {name:<22} = {value}" for name, value in rows]
    lines.append("    Residuals are loads divided by the training set's largest load; chi-square is in these units.")
    return "\n".join(lines)


def _variables(model: Model, found: Uncertainty) -> str:
    lines = [
        "[[Variables]]",
        f"    {'name':<22} {'value':>14} {'± stderr':>12} {'(rel.)':>9}  {'95 % interval':^29} "
        f"{'± independent':>13}  unit",
    ]
    for name, value, error, naive in zip(
        found.names, found.values, found.stderr, found.stderr_independent, strict=True
    ):
        unit = model.declared[name].unit if name in model.declared else ""
        if math.isfinite(error):
            relative = f"({100 * error / abs(value):.2f}%)" if value else ""
            low, high = value - INTERVAL * error, value + INTERVAL * error
            tail = f"{error:>12.4g} {relative:>9}  {low:>13.6g} … {high:<13.6g} {naive:>13.4g}  {unit}"
        else:
            tail = f"{'not determined by these rows':>38}  {unit}"
        lines.append(f"    {name:<22} {value:>14.8g} {tail}")
    lines.append("    stderr allows rows of one kinematic state to err together; 'independent' is the textbook figure.")
    return "\n".join(lines)


def _correlations(found: Uncertainty) -> str:
    error = found.stderr
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = found.covariance / np.outer(error, error)
    pairs = [
        (i, j)
        for i in range(len(error))
        for j in range(i)
        if np.isfinite(correlation[i, j]) and abs(correlation[i, j]) > SHOW_CORRELATION
    ]
    if not pairs:
        return ""
    pairs = sorted(pairs, key=lambda ij: -abs(correlation[ij]))[:20]
    lines = [f"[[Correlations]] (unreported correlations are < {SHOW_CORRELATION:.3f})"]
    lines += [f"    C({found.names[j]}, {found.names[i]}) = {correlation[i, j]:+.4f}" for i, j in pairs]
    return "\n".join(lines)


def _warnings(model: Model, found: Uncertainty, start: Tensor) -> str:
    lines = [f"    {note}" for note in [*notes(model, start), *effect_notes(model, found)]]
    undetermined = [n for n, e in zip(found.names, found.stderr, strict=True) if not math.isfinite(e)]
    if undetermined:
        shown = ", ".join(undetermined[:8]) + (f" and {len(undetermined) - 8} more" if len(undetermined) > 8 else "")
        lines.append(f"    not determined by these rows: {shown}")
    return "\n".join(["[[Warnings]]", *lines]) if lines else ""


def notes(model: Model, start: Tensor) -> list[str]:
    """Sentences on physical parameters at a bound, or still where the fit began."""
    found = []
    vector, physical = model.vector().detach(), model.scalars()
    lower, upper = model.raw_bounds()
    offset = len(vector) - len(model.declared)
    for i, name in enumerate(model.declared, offset):
        value = vector[i]
        reach = 1e-9 * max(1.0, float(value.abs()))
        if value - lower[i] <= reach or upper[i] - value <= reach:
            found.append(f"{name} is at its bound ({float(value):.6g} {model.declared[name].unit}).")
        elif model.declared[name].log and physical[name] < VANISHED * abs(model.declared[name].start):
            found.append(f"{name} has gone to zero: the rows ask for none of it.")
        elif torch.isclose(value, start[i], rtol=1e-7, atol=1e-12):
            found.append(f"{name} is still where the fit began: the rows may not depend on it.")
    return [*found, *model.remarks()]


def effect_notes(model: Model, uncertainty: Uncertainty) -> list[str]:
    """Sentences on effects that the rows do not need, or cannot tell from something else."""
    notes = []
    place = {name: i for i, name in enumerate(uncertainty.names)}
    error = uncertainty.stderr
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = uncertainty.covariance / np.outer(error, error)
    for name, spec in model.declared.items():
        i = place[name]
        if spec.none is None or not math.isfinite(error[i]):
            continue
        if abs(uncertainty.values[i] - spec.none) < INTERVAL * error[i]:
            notes.append(f"{name} is not significantly different from no effect: the rows do not ask for it.")
        twins = [n for n, j in place.items() if j != i and abs(correlation[i, j]) > STRONG_CORRELATION]
        if twins:
            notes.append(f"{name} is strongly correlated with {', '.join(twins)}: these rows hardly tell them apart.")
    return notes
