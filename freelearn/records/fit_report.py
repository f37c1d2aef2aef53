"""fit_report.txt, in the form that lmfit users know."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from torch import Tensor

from freelearn.common.formats import ascii_minus
from freelearn.data.beds import FORCE, MOMENT, Quantity
from freelearn.fitting.options import PROFILE
from freelearn.fitting.uncertainty import Uncertainty
from freelearn.physics.chain.model import Model
from freelearn.records.estimates import (
    correlations,
    effect_notes,
    fitted_estimates,
    interval_notes,
    intervals_caption,
    long_parameter_table,
    notes,
)

SHOW_CORRELATION = 0.1
MOST_CORRELATIONS = 20
MOST_UNDETERMINED = 8


def fit_report(
    model: Model[Any],
    uncertainty: Uncertainty,
    start: Tensor,
    method: str,
    message: str,
    epochs: int,
    counts: dict[str, int],
    measured: Sequence[Quantity],
    more: Sequence[str] = (),
) -> str:
    """Text with statistics, values ± standard errors, 95 % intervals, correlations and warnings.

    start: the raw vector (p,) before the fit, to tell parameters that never moved. counts: rows by what became of
    them. measured: what the bed measures. more: warnings that the rows give beside those of the parameters. Minus signs
    are hyphens, so that scripts can read the numbers.
    """
    parts = [
        _statistics(model, uncertainty, method, message, epochs, counts, measured),
        _variables(model, uncertainty),
        _correlations(uncertainty),
        _warnings(model, uncertainty, start, more),
    ]
    return ascii_minus("\n".join(part for part in parts if part)) + "\n"


def _statistics(
    model: Model[Any], uncertainty: Uncertainty, method: str, message: str, epochs: int, counts: dict[str, int],
    measured: Sequence[Quantity],
) -> str:  # fmt: skip
    n, p, chi2 = uncertainty.residuals, int(model.free.sum()), uncertainty.chi_square
    per_residual = n * math.log(chi2 / n) if chi2 > 0 else -math.inf
    rows = [
        ("fitting method", method),
        ("outcome", message),
        ("# epochs", epochs),
        ("# data points", f"{n} ({' and '.join(q.name for q in measured)} of {uncertainty.rows} rows)"),
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
    what = "loads divided by the training set's largest load"
    if not {FORCE, MOMENT}.issuperset(measured):
        what = "readings divided by the training set's largest of their kind"
    lines.append(f"    Residuals are {what}; chi-square is in these units.")
    return "\n".join(lines)


def _variables(model: Model[Any], uncertainty: Uncertainty) -> str:
    estimates = fitted_estimates(uncertainty, model)
    table = long_parameter_table(estimates)
    freedom = f"Student's t with {uncertainty.freedom} degrees of freedom, kinematic states less parameters"
    explained = [
        "stderr allows rows of one kinematic state to err together; 'independent' is the textbook figure.",
        f"95 % intervals: {freedom};",
        "on the logarithmic scale where the logarithm is fitted.",
    ]
    if PROFILE in uncertainty.kinds:
        explained[1:] = [
            f"{intervals_caption(estimates)}.",
            "They hold the values at which the least sum of squares over all other parameters is not much higher:",
            "by t² times the rise that one standard error makes where the model is linear. t:",
            f"{freedom}.",
        ]
    return "\n".join(["[[Variables]]", table.text("    "), *(f"    {line}" for line in explained)])


def _correlations(uncertainty: Uncertainty) -> str:
    correlation = correlations(uncertainty)
    pairs = [
        (i, j)
        for i in range(len(correlation))
        for j in range(i)
        if np.isfinite(correlation[i, j]) and abs(correlation[i, j]) > SHOW_CORRELATION
    ]
    if not pairs:
        return ""
    pairs = sorted(pairs, key=lambda ij: -abs(correlation[ij]))[:MOST_CORRELATIONS]
    names = uncertainty.names
    lines = [f"[[Correlations]] (unreported correlations are < {SHOW_CORRELATION:.3f})"]
    lines += [f"    C({names[j]}, {names[i]}) = {correlation[i, j]:+.4f}" for i, j in pairs]
    return "\n".join(lines)


def _warnings(model: Model[Any], uncertainty: Uncertainty, start: Tensor, of_rows: Sequence[str]) -> str:
    said = [*notes(model, start), *effect_notes(model, uncertainty), *interval_notes(uncertainty), *of_rows]
    lines = [f"    {note}" for note in said]
    told = zip(uncertainty.names, uncertainty.stderr, uncertainty.kinds, strict=True)
    unknown = [(name, kind) for name, error, kind in told if not math.isfinite(error)]
    for what, profiled in (("not determined by these rows", False), ("determined by bounds and curvature alone", True)):
        names = [name for name, kind in unknown if (kind == PROFILE) is profiled]
        more = len(names) - MOST_UNDETERMINED
        shown = ", ".join(names[:MOST_UNDETERMINED]) + (f" and {more} more" if more > 0 else "")
        lines += [f"    {what}: {shown}"] if names else []
    return "\n".join(["[[Warnings]]", *lines]) if lines else ""
