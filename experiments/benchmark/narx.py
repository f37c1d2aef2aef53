"""SysIdentPy's polynomial NARX models (FROLS), run freely: the peer that names nothing."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
# A series: inputs (n, k) and what was measured (n,).
Series = tuple[Array, Array]
# What is tried, and chosen by the series that it was fitted to, run freely: degrees of the polynomial, lags of outputs
# and inputs, and most terms.
DEGREES, LAGS, TERMS = (1, 2, 3), (1, 2, 4), 20
# A model that leaves this many times the range has run away.
AWAY = 10.0


class Narx:
    """A polynomial of the last readings and inputs, the inputs of the same row among them.

    Terms by FROLS and the Bayesian information criterion; series are joined, and the few rows at joints count as others
    do. Inputs and readings count in their largest size.
    """

    def __init__(self, series: Sequence[Series], degrees: Sequence[int] = DEGREES, lags: Sequence[int] = LAGS) -> None:
        inputs, read = (np.concatenate([each[i] for each in series]) for i in (0, 1))
        self.unit, self.size = np.abs(inputs).max(0), float(np.abs(read).max())
        fits = [_fitted(inputs / self.unit, read / self.size, *choice) for choice in product(degrees, lags)]
        errors = [self._error(fit, series) for fit in fits]
        self.best = fits[int(np.argmin(errors))]

    def __call__(self, inputs: Array, told: Array) -> Array:
        """What is read along inputs (n, k), from the first readings of told (n,) on, as many as `told_rows`; NaN from
        where it has run away."""
        return self._run(self.best, inputs, told)

    @property
    def told_rows(self) -> int:
        """How many readings of each series it is told."""
        return self.best.lags

    def _error(self, fit: _Fit, series: Sequence[Series]) -> float:
        misses = np.concatenate([self._run(fit, x, y)[fit.lags :] - y[fit.lags :] for x, y in series])
        return float(np.mean(misses**2)) if np.isfinite(misses).all() else np.inf

    def _run(self, fit: _Fit, inputs: Array, told: Array) -> Array:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            x, y = _ahead(inputs / self.unit), (told / self.size)[:, None]
            found: Array = fit.model.predict(X=x, y=y[: fit.lags])[: len(x), 0]
        gone = ~(np.abs(found) < AWAY)
        if gone.any():
            found = np.where(np.arange(len(found)) >= int(gone.argmax()), np.nan, found)
        return found * self.size


@dataclass(frozen=True)
class _Fit:
    """model: SysIdentPy's. lags: readings that it looks back."""

    model: Any
    lags: int


def _fitted(inputs: Array, read: Array, degree: int, lags: int) -> _Fit:
    # Not above: it is here for this benchmark alone (see the Makefile).
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    back = list(range(1, lags + 1))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        model = FROLS(
            order_selection=True, n_info_values=TERMS, info_criteria="bic", ylag=back,
            xlag=back if inputs.shape[1] == 1 else [back] * inputs.shape[1],
            estimator=LeastSquares(), basis_function=Polynomial(degree=degree),
        )  # fmt: skip
        model.fit(X=_ahead(inputs), y=read[:, None])
    return _Fit(model, lags)


def _ahead(inputs: Array) -> Array:
    """Inputs (n, k) one row early, so that SysIdentPy's first lag is the same row."""
    return np.concatenate([inputs[1:], inputs[-1:]])


def whole(there: Array, least: int) -> Iterator[slice]:
    """Stretches of rows (n,) bool that are all there, of so many rows at least.

    >>> list(whole(np.array([1, 1, 0, 1, 1, 1], dtype=bool), 2))
    [slice(0, 2, None), slice(3, 6, None)]
    """
    ends = np.flatnonzero(np.diff(np.r_[False, there, False].astype(int)))
    yield from (slice(int(a), int(b)) for a, b in zip(ends[::2], ends[1::2], strict=True) if b - a >= least)
