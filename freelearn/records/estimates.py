"""Fitted parameters with what is known of their uncertainty, the table that shows them, and what to know of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.common.display import DisplayTable
from freelearn.common.formats import finite, number, percent
from freelearn.data.beds import behind
from freelearn.fitting.options import NORMAL, PROFILE
from freelearn.fitting.uncertainty import Uncertainty, ends, quantile
from freelearn.physics.chain.known_parameters import FIXED
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameter

# What a researcher should know about fitted parameters: sentences for report, page and terminal.

# Share of its usual size below which a positive parameter counts as gone.
VANISHED = 1e-8
# A correlation above this is worth a warning.
STRONG_CORRELATION = 0.95
# Standard errors larger than so many times the value tell nothing of a positive parameter: 95 % of its logarithm is
# then a factor of fifty to both sides. Of few rows smaller ones do as little: not where 95 % reach to so many times it.
UNTOLD, UNTOLD_END = 2.0, 1000.0


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
        # Of the entries of a matrix the model itself says where they are.
        if name not in model.unnatural and (value - lower[i] <= reach or upper[i] - value <= reach):
            said.append(f"{name} is at its bound ({number(physical[name], 6)}{behind(model.declared[name].unit)}).")
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
    u = uncertainty
    for name, value, error, high, kind in zip(u.names, u.values, u.stderr, u.high, u.kinds, strict=True):
        spec = model.declared.get(name)
        # What has gone to zero is told of by itself.
        if spec is None or not spec.log or kind == PROFILE or value < VANISHED * abs(spec.start):
            continue
        if says_nothing(value, error, high) and error < math.inf:
            said.append(untold_sentence(name, value, error, spec.unit))
    return said


def says_nothing(value: float, error: float, high: float) -> bool:
    """Whether a standard error and the interval's end say nothing of a positive parameter."""
    return error > UNTOLD * value or high > UNTOLD_END * value


def untold_sentence(name: str, value: float, error: float, unit: str) -> str:
    """That the rows say nothing of a positive parameter.

    >>> untold_sentence("C1", 2.2e17, 5.8e40, "Pa")
    'C1 = 2.2e+17 Pa is not determined by these rows: its standard error is 2.6e+23 times as large.'
    >>> untold_sentence("C2", 5.1e4, 4.6e4, "Pa")
    'C2 = 5.1e+04 Pa is not determined by these rows: they are too few for its standard error of 4.6e+04 Pa.'
    """
    why = f"its standard error is {number(error / value, 2)} times as large"
    if error <= UNTOLD * value:
        why = f"they are too few for its standard error of {number(error, 2)}{behind(unit)}"
    return f"{name} = {number(value, 2)}{behind(unit)} is not determined by these rows: {why}."


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


# Fitted parameters with what is known of their uncertainty, and the one table that shows them.

# SI units: no parameter that does anything is so small.
GONE = 1e-20
HEADINGS = ("value", "± stderr", "95 % from", "to")


@dataclass(frozen=True)
class Estimate:
    """One parameter in its unit (SI). stderr, low, high (95 %), independent: NaN where the rows do not determine it.

    low, high: infinite where a profile has no end. independent: the standard error under independent residuals, NaN
    where none was computed. kind: of the interval, normal or profile, "" without one; note: what to know of it.
    beforehand: what its user said of it before the fit, "" for nothing.
    """

    name: str
    value: float
    unit: str = ""
    stderr: float = math.nan
    low: float = math.nan
    high: float = math.nan
    independent: float = math.nan
    kind: str = ""
    note: str = ""
    beforehand: str = ""

    @property
    def untold(self) -> bool:
        """Whether the rows say nothing of a positive parameter: the interval of its logarithm spans decades."""
        return (
            self.kind == NORMAL
            and self.value > 0
            and self.low >= 0
            and says_nothing(self.value, self.stderr, self.high)
        )

    @property
    def ends(self) -> tuple[float, float, float, float]:
        """stderr, low, high and independent as tables show them: NaN of what the rows do not determine, where neither
        digits nor ends would mean anything; a note says so."""
        return (math.nan,) * 4 if self.untold else (self.stderr, self.low, self.high, self.independent)

    @classmethod
    def from_plain(cls, name: str, entry: Mapping[str, Any]) -> Estimate:
        """The estimate whose entry `plain` wrote."""
        keys = {
            "stderr": "stderr", "low": "low", "high": "high", "independent": "stderr_independent",
            "kind": "interval", "note": "interval_note", "beforehand": "beforehand",
        }  # fmt: skip
        known = {field: entry[key] for field, key in keys.items() if entry.get(key) is not None}
        return cls(name, entry["value"], entry["unit"], **known)

    def plain(self) -> dict[str, float | str | None]:
        """The entry in results.json; what does not exist is null."""
        return {
            "value": self.value,
            "stderr": finite(self.stderr),
            "unit": self.unit,
            "low": finite(self.low),
            "high": finite(self.high),
            "stderr_independent": finite(self.independent),
            "interval": self.kind or None,
            "interval_note": self.note or None,
            **({"beforehand": self.beforehand} if self.beforehand else {}),
        }


def fitted_estimates(uncertainty: Uncertainty, model: Model[Any]) -> list[Estimate]:
    """An estimate for each entry of a fitted raw vector, weights included; these have no unit."""
    declared, beforehand = model.declared, model.beforehand()
    u = uncertainty
    columns = (u.values, u.stderr, u.low, u.high, u.stderr_independent)
    units = [declared[name].unit if name in declared else "" for name in uncertainty.names]
    numbers = (map(float, entry) for entry in zip(*columns, strict=True))
    return [
        Estimate(name, value, unit, stderr, low, high, independent, kind, words, beforehand.get(name, ""))
        for name, unit, (value, stderr, low, high, independent), kind, words in zip(
            u.names, units, numbers, u.kinds, u.words, strict=True
        )
    ]


def plain_estimates(values: Mapping[str, float], declared: Mapping[str, Parameter]) -> list[Estimate]:
    """Estimates of parameters that were not fitted: values alone."""
    return [Estimate(name, value, declared[name].unit) for name, value in values.items()]


def searched_quantile(model: Model[Any], states: int) -> float:
    """Standard errors to either end of a 95 % interval of a search's model, so many kinematic states counted once."""
    return quantile(max(states - int(model.free.sum()), 1))


def searched_estimates(
    values: Mapping[str, float], stderr: Mapping[str, float], reach: Mapping[str, float], model: Model[Any]
) -> list[Estimate]:
    """Estimates from values, standard errors and how far their 95 % intervals reach (SI).

    A parameter without a standard error has no interval, and one that was held has no error."""
    entries, beforehand = [], model.beforehand()
    for name, value in values.items():
        p = model.declared[name]
        error, far = (0.0 if p.fixed else known.get(name, math.nan) for known in (stderr, reach))
        low, high = ends([value], [far], [p.log])
        both, said = (float(low[0]), float(high[0])), beforehand.get(name, "")
        entries.append(Estimate(name, value, p.unit, error, *both, kind=NORMAL, beforehand=said))
    return entries


def parameter_table(estimates: Sequence[Estimate], title: str = "") -> DisplayTable:
    """Parameters with 95 % intervals."""
    rows, last = [], _last(estimates)
    for e in estimates:
        error, low, high, _ = e.ends
        cells = [number(shown_value(e.value), 2 if e.untold else 5), number(error, 2), number(low, 4), number(high, 4)]
        rows.append([e.name, *cells, e.unit, e.beforehand][: 5 + len(last)])
    return DisplayTable.from_rows(["parameter"], HEADINGS, rows, title, intervals_caption(estimates), last)


def _last(estimates: Sequence[Estimate]) -> list[str]:
    """Headings of the last columns: what was known beforehand, where there is any."""
    return ["unit", "beforehand"] if any(e.beforehand for e in estimates) else ["unit"]


def shown_value(value: float) -> float:
    """Zero in the place of what a logarithm has run away to: 3.8e−34 Pa tells a reader nothing, a note says the rest.

    >>> shown_value(3.8e-34), shown_value(-2e-9)
    (0.0, -2e-09)
    """
    return 0.0 if abs(value) < GONE else value


def intervals_caption(estimates: Sequence[Estimate]) -> str:
    """Which kind of intervals these are, where some are not the usual, normal ones, and which parameters the rows do
    not determine; else nothing."""
    untold = [e.name for e in estimates if e.untold]
    said = f"not determined by these rows: {', '.join(untold)}" if untold else ""
    normal = [e.name for e in estimates if e.kind == NORMAL and e.beforehand != FIXED]
    if not any(e.kind == PROFILE for e in estimates):
        return said
    rest = f"; of {', '.join(normal)}: normal" if normal else ""
    return "; ".join(filter(None, [f"95 % intervals: profile likelihood{rest}", said]))


def long_parameter_table(estimates: Sequence[Estimate]) -> DisplayTable:
    """Parameters as in a fit report: more digits, the relative standard error, and the textbook one."""
    rows, last = [], _last(estimates)
    for e in estimates:
        # An unknown standard error, or one beyond all bounds, leaves its cells blank; the report names the parameter
        # under its warnings.
        error, low, high, independent = e.ends
        relative = f"({percent(error / abs(e.value))}%)" if e.value and math.isfinite(error) else ""
        known = [number(error, 4), relative, number(low, 6), number(high, 6), number(independent, 4)]
        rows.append([e.name, number(shown_value(e.value), 8), *known, e.unit, e.beforehand][: 7 + len(last)])
    numbers = ("value", "± stderr", "(rel.)", "95 % from", "to", "± independent")
    return DisplayTable.from_rows(["name"], numbers, rows, last=last)
