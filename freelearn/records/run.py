"""One run: a model, fitted on one training set and evaluated on test sets, without and with its effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from torch import Tensor

from freelearn.common.display import DisplayTable
from freelearn.common.formats import error_percent, finite, fixed
from freelearn.data.accuracy import Accuracy
from freelearn.data.columns import left_out_rows, usable_rows
from freelearn.data.error import Error
from freelearn.data.sets import TRAIN, VALIDATION
from freelearn.fitting.uncertainty import Uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.records.estimates import Estimate, fitted_estimates, plain_estimates

if TYPE_CHECKING:
    # For its type alone.
    from freelearn.discovery.residuals.failures import Misfit


@dataclass(frozen=True)
class Compared:
    """E of one test set (fractions) without and with the effects, whole kinematic states that neither fit saw.

    n: rows scored, those that both models answer: the same ones, or the model that answers less would look better.
    """

    without: float
    with_effects: float
    n: int

    def plain(self) -> dict[str, float | None]:
        """The entry in results.json."""
        return {"without": finite(self.without), "with": finite(self.with_effects), "n": self.n}


def comparison_table(comparison: Mapping[str, Compared]) -> DisplayTable:
    """E without and with the effects by test set, and their ratio."""
    rows = []
    for name, pair in comparison.items():
        ratio = fixed(pair.with_effects / pair.without if pair.without > 0 else None, 2)
        rows.append([name, error_percent(pair.without), error_percent(pair.with_effects), ratio, str(pair.n)])
    return DisplayTable.from_rows(
        ["test set"],
        ["E without %", "E with effects %", "ratio", "rows"],
        rows,
        title="Without and with the effects",
        caption="Whole kinematic states that neither fit saw; scored on the rows that both answer.",
    )


@dataclass(frozen=True)
class Run:
    """What came out. What is computed later is added by dataclasses.replace.

    table: measurement table of N rows. labels: each row's split, (N,), "" for buckled and left-out ones. prediction: of
    all rows. errors: by test set. uncertainty: of the fitted parameters, None when nothing was fitted. start: raw
    vector (p,) before the fit. history: epoch, training and validation error. seconds: of this run; fit_seconds: of the
    fit, which an earlier run made when it is `reused`. comparison: by test set, without and with the effects; empty
    where there are none. misfit: where the model fails and how small its error could be; None without a stated
    accuracy. accuracy: of the measuring, stated or judged from the residuals, None where nothing tells it.
    """

    model: Model[Any]
    train: str
    method: str
    table: pd.DataFrame
    labels: np.ndarray
    prediction: Prediction
    errors: Mapping[str, Error]
    uncertainty: Uncertainty | None
    start: Tensor
    history: tuple[tuple[int, float, float], ...] = ()
    message: str = "nothing was fitted"
    seconds: float = 0.0
    fit_seconds: float = 0.0
    reused: bool = False
    comparison: Mapping[str, Compared] | None = None
    misfit: Misfit | None = None
    accuracy: Accuracy | None = None

    @property
    def title(self) -> str:
        """Model and effects."""
        return " + ".join([self.model.name, *(effect.name for effect in self.model.effects)])

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the declared parameters, in their order, SI (k, k); NaN where one is not known, as in a run that fitted
        nothing. A network's weights are left out."""
        declared = list(self.model.declared)
        if self.uncertainty is None:
            return np.full((len(declared), len(declared)), np.nan)
        place = [self.uncertainty.names.index(name) for name in declared]
        known: np.ndarray = self.uncertainty.covariance[np.ix_(place, place)]
        return np.where(np.isfinite(known), known, np.nan)

    def estimates(self) -> list[Estimate]:
        """The physical parameters; of a network its weights and biases, as far as they were fitted."""
        if self.uncertainty is None:
            return plain_estimates(self.model.scalars(), self.model.declared)
        return fitted_estimates(self.uncertainty, self.model)

    def counts(self) -> dict[str, int]:
        """Rows of the table: all, used by the fit, buckled, left out by the user, and of the others those without a
        valid prediction, by reason."""
        marked = {"buckled": int((self.table["buckled"] == 1).sum()), "left_out": int(left_out_rows(self.table).sum())}
        status = self.prediction.status.numpy()[usable_rows(self.table)]
        used = self.uncertainty.rows if self.uncertainty else 0
        reasons = {s.name.lower(): int((status == s).sum()) for s in Status if s != Status.OK}
        return {"rows": len(self.table), "used": used, **marked, **reasons}


def seen_rows(model: Model[Any], labels: pd.Series) -> np.ndarray:
    """Rows that a fit of the model sees, by the labels of their split, (N,) bool: what a network's fit stops by it has
    seen too."""
    seen: np.ndarray = labels.isin([TRAIN, VALIDATION] if model.needs_validation else [TRAIN]).to_numpy()
    return seen
