"""Fitting a model on one training set and evaluating it on test sets, without and with its effects."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.error import Error, common, set_error
from freelearn.data.rows import Rows
from freelearn.data.sets import CONSTITUENT_SET, SHARES, TEST, TRAIN, VALIDATION, samples_of, set_names, split_rows
from freelearn.fitting.options import NORMAL, PROFILE, FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.profiles import ProgressCallback, profiled
from freelearn.fitting.store import FitOutcome, FitStore, Fitted, fit_key, timed
from freelearn.fitting.uncertainty import Uncertainty, uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.models.continuum import CONSTITUENT
from freelearn.records.run import Compared, Run
from freelearn.report.tensorboard_log import log_run

if TYPE_CHECKING:
    from lightning import Callback


# Makes what is told of a fit's epochs, once there is a fit to make: a kept one needs no Lightning.
Progress = Callable[[], "Callback"]


def run(
    model: Model,
    table: pd.DataFrame,
    train: str,
    tests: Sequence[str] | str,
    options: FitOptions | None,
    seed: int,
    by_states: bool = False,
    folder: Path | None = None,
    progress: Progress | None = None,
    store: FitStore | None = None,
    constituents: Mapping[str, float] = CONSTITUENT,
    shares: tuple[float, float] = SHARES,
    device: str = "cpu",
    told: ProgressCallback | None = None,
) -> Run:
    """Fits (options None: not at all) and evaluates; `tests` is one set's name or "every". Raises UserError.

    With one test set, rows of samples that are neither trained nor tested on are left out. store: where the fit is
    looked up before it is computed, and kept afterwards. constituents: parameters of train=constituent, SI. shares:
    of training and of validation rows. device: where the fit computes. told: of the search for profile intervals.
    """
    began = time.perf_counter()
    if tests != "every":
        table = _concerned(table, train, str(tests))
    labels = split_rows(table, seed, by_states, shares)
    rows = Rows.from_table(table)
    if train == CONSTITUENT_SET:
        if model.name != "continuum":
            raise UserError(
                f"train=constituent gives C1 and C2 of the continuum model: choose another set to fit {model.name} on."
            )
        model.set_values(constituents)
        options = None
    elif not model.needs_validation:
        # Not np.where, which makes a word of its own for each row.
        labels[labels == VALIDATION] = TRAIN
    if options is None and model.needs_validation:
        raise UserError("A network has no parameters before a fit: choose a fit other than none.")
    start: Tensor = model.vector().detach().clone()
    fitted = None
    if options:
        fitted = _fitted(model, rows, labels, train, options, seed, folder, progress, device, store, told)

    with torch.no_grad():
        loads, status = model.to(device)(rows.states.to(device))
        prediction = Prediction(loads.cpu(), status.cpu())
        model.to("cpu")
    return Run(
        model=model,
        train=train,
        method=options.name if options else "none",
        table=table,
        labels=labels,
        prediction=prediction,
        errors=_errors(rows, labels, prediction, _test_sets(table, labels, train, tests), by_states),
        uncertainty=fitted.uncertainty if fitted else None,
        start=fitted.outcome.initial if fitted else start,
        history=tuple(fitted.outcome.history) if fitted else (),
        message=fitted.outcome.message if fitted else "nothing was fitted",
        seconds=time.perf_counter() - began,
        fit_seconds=fitted.seconds if fitted else 0.0,
        reused=fitted.reused if fitted else False,
    )


def _fitted(
    model: Model,
    rows: Rows,
    labels: np.ndarray,
    train: str,
    options: FitOptions,
    seed: int,
    folder: Path | None,
    progress: Progress | None,
    device: str,
    store: FitStore | None,
    told: ProgressCallback | None,
) -> Fitted:
    """The fit, from the store or else made now; the model holds its parameters afterwards.

    The fit is kept as one with normal intervals, and with those of profiles once more, under a key of its own: either
    is found again by a run that needs it, and asking for profiles fits nothing anew.
    """
    sample = rows.states.sample.numpy()
    inside = np.isin(sample, samples_of(train, sample))
    training = torch.as_tensor(np.flatnonzero(inside & (labels == TRAIN)))
    validation = torch.as_tensor(np.flatnonzero(inside & (labels == VALIDATION)))
    if not len(training):
        raise UserError(f"Training set {train!r} has no rows to fit, all are buckled or left out: choose another one.")
    parts = rows[training], rows[validation]

    def problem(outcome: FitOutcome) -> Problem:
        return Problem(model, parts[0] if outcome.kept.all() else parts[0][torch.as_tensor(outcome.kept)])

    def compute() -> tuple[FitOutcome, Uncertainty]:
        # Lightning takes seconds to import, and a fit that was kept needs none of it.
        from freelearn.fitting.fit import fit

        outcome = fit(model, *parts, options, seed, folder, progress() if progress else None, device)
        return outcome, uncertainty(problem(outcome))

    def fitted() -> Fitted:
        if store is None:
            return timed(compute)
        key = fit_key(model, *parts, replace(options, intervals=NORMAL), seed)
        return store.fitted(model, key, lambda: timed(compute))

    def with_profiles() -> Fitted:
        made = fitted()
        return replace(made, uncertainty=profiled(problem(made.outcome), made.uncertainty, told))

    if options.intervals != PROFILE:
        return fitted()
    return store.fitted(model, fit_key(model, *parts, options, seed), with_profiles) if store else with_profiles()


def _test_sets(table: pd.DataFrame, labels: np.ndarray, train: str, tests: Sequence[str] | str) -> list[str]:
    """The sets that are scored: of every set those with test rows, and a training set that is one of them or the
    user's own."""
    if tests != "every":
        return [str(tests)]
    sample = table["sample"].to_numpy()
    every = set_names(sample)
    tested = [name for name in every if len(scored_rows(sample, labels, name))]
    return [*tested, train] if "+" in train or train in set(every) - set(tested) else tested


def _errors(
    rows: Rows, labels: np.ndarray, prediction: Prediction, names: Sequence[str], by_states: bool
) -> dict[str, Error]:
    """The error on each test set's test rows. Raises UserError for a set without any."""
    sample = rows.states.sample.numpy()
    usable = prediction.status == Status.OK
    errors = {}
    for name in names:
        pick = scored_rows(sample, labels, name)
        if not len(pick):
            raise UserError(
                f"Test set {name!r} has no rows to score: {_why_untested(sample, labels, name, by_states)}."
            )
        errors[name] = set_error(rows[pick], prediction.loads[pick], usable[pick])
    return errors


def _why_untested(sample: np.ndarray, labels: np.ndarray, name: str, by_states: bool) -> str:
    if not (labels[np.isin(sample, samples_of(name, sample))] != "").any():
        return "all are buckled or left out"
    if by_states:
        return "all its kinematic states are trained on: use split=rows"
    return "all its rows are trained on"


def scored_rows(sample: np.ndarray, labels: np.ndarray, name: str) -> Tensor:
    """Positions of the test rows of a named set. sample, labels: (N,), of all rows."""
    return torch.as_tensor(np.flatnonzero(np.isin(sample, samples_of(name, sample)) & (labels == TEST)))


def _concerned(table: pd.DataFrame, train: str, test: str) -> pd.DataFrame:
    """Rows of the samples that are trained or tested on."""
    sample = table["sample"].to_numpy()
    sets = [name for name in (train, test) if name != CONSTITUENT_SET]
    chosen = np.concatenate([samples_of(name, sample) for name in sets])
    return table[np.isin(sample, chosen)].reset_index(drop=True)


# A model without and with its effects, on kinematic states that neither fit has seen.

# Where each fit keeps its TensorBoard curves, beside those of the run itself.
WITHOUT, WITH = "without_effects", "with_effects"


def compare(one: Callable[[bool, Path], Run], folder: Path) -> dict[str, Compared]:
    """E of each test set without and with effects: whole kinematic states that neither fit saw, rows that both answer.

    one: with effects?, folder → the run. Both leave their TensorBoard curves in `folder`, in folders of their own, so
    that they show over each other.
    """
    runs: dict[str, Run] = {}
    for name, effects in ((WITHOUT, False), (WITH, True)):
        runs[name] = one(effects, folder / name)
        log_run(runs[name], folder / name)
    return compared(runs[WITHOUT], runs[WITH])


def can_hold_out(table: pd.DataFrame, name: str, seed: int, shares: tuple[float, float]) -> bool:
    """Whether whole kinematic states of a named set are held out by a split of these shares."""
    labels = split_rows(table, seed, True, shares)
    return len(scored_rows(table["sample"].to_numpy(), labels, name)) > 0


def compared(without: Run, with_effects: Run) -> dict[str, Compared]:
    """Errors of two runs over the same table and split, each test set scored on the rows that both answer."""
    measured, sample = Rows.from_table(without.table), without.table["sample"].to_numpy()
    both = common(*(run.prediction.status == Status.OK for run in (without, with_effects)))
    pairs = {}
    for name in without.errors:
        pick = scored_rows(sample, without.labels, name)
        errors = [set_error(measured[pick], run.prediction.loads[pick], both[pick]) for run in (without, with_effects)]
        pairs[name] = Compared(errors[0].E, errors[1].E, errors[0].n)
    return pairs
