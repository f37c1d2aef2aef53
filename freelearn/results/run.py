"""One run: a model, fitted on one training set and evaluated on test sets."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import lightning as L
import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.fit.fit import FitOutcome, fit
from freelearn.fit.options import FitOptions
from freelearn.fit.problem import Problem
from freelearn.fit.store import FitStore, Fitted, fit_key, timed
from freelearn.fit.uncertainty import Uncertainty, uncertainty
from freelearn.measurements.error import Error, set_error
from freelearn.measurements.rows import Rows
from freelearn.measurements.sets import SHARES, TEST, TRAIN, VALIDATION, samples_of, set_names, split_rows
from freelearn.measurements.states import States, kinematic_state, measured_loads
from freelearn.models.base import Model
from freelearn.models.continuum import CONSTITUENT
from freelearn.models.prediction import Prediction, Status

CONSTITUENT_SET = "constituent"


@dataclass
class Run:
    """What came out. labels: each row's split ("" for buckled), (N,). errors: by test set. uncertainty: the fitted
    parameters' uncertainty, None when nothing was fitted. history: epoch, training and validation error.
    seconds: of this run; fit_seconds: of the fit, which an earlier run made when it is `reused`."""

    model: Model
    train: str
    method: str
    table: pd.DataFrame
    labels: np.ndarray
    prediction: Prediction
    errors: dict[str, Error]
    uncertainty: Uncertainty | None
    start: Tensor
    history: list[tuple[int, float, float]] = field(default_factory=list)
    message: str = "nothing was fitted"
    seconds: float = 0.0
    fit_seconds: float = 0.0
    reused: bool = False


def run(
    model: Model,
    table: pd.DataFrame,
    train: str,
    tests: Sequence[str] | str,
    options: FitOptions | None,
    seed: int,
    by_states: bool = False,
    folder: Path | None = None,
    progress: L.Callback | None = None,
    store: FitStore | None = None,
    constituents: Mapping[str, float] = CONSTITUENT,
    shares: tuple[float, float] = SHARES,
    device: str = "cpu",
) -> Run:
    """Fits (options None: not at all) and evaluates; `tests` is one set's name or "every". Raises UserError.

    With one test set, rows of samples that are neither trained nor tested on are left out. store: where the fit is
    looked up before it is computed, and kept afterwards. constituents: parameters of train=constituent, SI. shares:
    of training and of validation rows. device: where the fit computes.
    """
    began = time.perf_counter()
    if tests != "every":
        table = _concerned(table, train, str(tests))
    sample = table["sample"].to_numpy()
    names = set_names(sample) if tests == "every" else [str(tests)]
    if tests == "every" and "+" in train:
        # A set of the user's own: a run always tells its error on the training set's test rows.
        names.append(train)
    chosen = {name: np.isin(sample, samples_of(name, sample)) for name in names}
    labels = split_rows(table, seed, by_states, shares)
    rows = Rows(States.from_table(table), measured_loads(table), kinematic_state(table))

    if train == CONSTITUENT_SET:
        if model.name != "continuum":
            raise UserError(f"train=constituent gives C1 and C2 of the continuum model; {model.name} has none.")
        model.set_values(constituents)
        options = None
    else:
        in_training = np.isin(sample, samples_of(train, sample))
        if not model.needs_validation:
            labels = np.where(labels == VALIDATION, TRAIN, labels)
    start = model.vector().detach().clone()
    fitted: Fitted | None = None
    if options is not None:
        training = torch.as_tensor(np.flatnonzero(in_training & (labels == TRAIN)))
        validation = torch.as_tensor(np.flatnonzero(in_training & (labels == VALIDATION)))
        if not len(training):
            raise UserError(f"Training set {train!r} has no un-buckled rows to fit: choose another one.")
        parts = rows[training], rows[validation]
        key = fit_key(model, *parts, options, seed) if store else ""

        def compute() -> tuple[FitOutcome, Uncertainty]:
            outcome = fit(model, *parts, options, seed, folder, progress)
            return outcome, uncertainty(Problem(model, parts[0][torch.as_tensor(outcome.kept)]))

        fitted = store.fitted(model, key, lambda: timed(compute)) if store else timed(compute)
        start = fitted.outcome.initial
    elif model.needs_validation:
        raise UserError("A network has no parameters before a fit: choose a fit other than none.")

    with torch.no_grad():
        prediction = model(rows.states)
    usable = prediction.status == Status.OK
    errors = {}
    for name, inside in chosen.items():
        pick = torch.as_tensor(np.flatnonzero(inside & (labels == TEST)))
        if not len(pick):
            raise UserError(f"Test set {name!r} has no un-buckled rows: nothing can be scored on it.")
        errors[name] = set_error(rows.loads[pick], prediction.loads[pick], usable[pick])
    method = options.name if options else "none"
    outcome = Run(model, train, method, table, labels, prediction, errors, None, start)
    if fitted:
        outcome.uncertainty, outcome.reused, outcome.fit_seconds = fitted.uncertainty, fitted.reused, fitted.seconds
        outcome.history, outcome.message = fitted.outcome.history, fitted.outcome.message
    outcome.seconds = time.perf_counter() - began
    return outcome


def _concerned(table: pd.DataFrame, train: str, test: str) -> pd.DataFrame:
    """Rows of the samples that are trained or tested on."""
    sample = table["sample"].to_numpy()
    sets = [name for name in (train, test) if name != CONSTITUENT_SET]
    chosen = np.concatenate([samples_of(name, sample) for name in sets])
    return table[np.isin(sample, chosen)].reset_index(drop=True)
