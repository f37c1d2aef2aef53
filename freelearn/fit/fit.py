"""Fitting a model to training rows: starts, the run by Lightning, and the rows that have to stay out."""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import lightning as L
import numpy as np
import torch
from lightning.pytorch.loggers import TensorBoardLogger
from torch import Tensor

from freelearn.errors import UserError
from freelearn.fit.algorithm import OPTIMIZERS, Algorithm, GradientEpochs, LevenbergMarquardtEpochs
from freelearn.fit.batches import FitData
from freelearn.fit.fitting import Fitting
from freelearn.fit.options import LEVENBERG_MARQUARDT, FitOptions
from freelearn.fit.problem import Problem
from freelearn.fit.starts import starts
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status

# Most rounds in which the rows of the loss may change.
ROUNDS = 8


@dataclass(frozen=True)
class FitOutcome:
    """kept: training rows that took part, (N,) bool. initial: raw vector (p,) before the fit. history: epoch,
    training and validation error."""

    kept: np.ndarray
    initial: Tensor
    history: list[tuple[int, float, float]]
    message: str


def fit(
    model: Model,
    train: Rows,
    validation: Rows,
    options: FitOptions,
    seed: int,
    folder: Path | None = None,
    progress: L.Callback | None = None,
) -> FitOutcome:
    """Fits `model` in place. Raises UserError when there are too few rows.

    The first round takes all rows; one that has no answer (no equilibrium, singular, overstretched) counts with the
    finite loads that the model puts there. Rows without an answer at the solution then leave the loss, and the fit
    goes on with the rest, until the set agrees with itself. If leaving them out drives further rows out, the first
    round's fit stands: otherwise a model could lower its loss by explaining less.
    """
    generator = torch.Generator().manual_seed(seed)
    initial = model.vector().detach().clone()
    kept, kept_validation = torch.ones(len(train), dtype=torch.bool), torch.ones(len(validation), dtype=torch.bool)
    _check_count(model, len(train), len(train))
    model.prepare(train.states, train.loads)
    places = starts(model, train.states, train.loads, options.restarts if model.needs_restarts else 1, generator)
    history: list[tuple[int, float, float]] = []
    settled = None
    for _ in range(ROUNDS):
        make = partial(_algorithm, starts=places, options=options, generator=generator)
        module = Fitting(model, make, options.max_epochs, options.patience, options.race)
        trainer = _trainer(folder, progress)
        with warnings.catch_warnings():
            # One batch of everything needs no loader workers; Lightning advises them at every fit.
            warnings.simplefilter("ignore")
            try:
                trainer.fit(module, datamodule=FitData(train[kept], validation[kept_validation]))
            except SystemExit:
                # What Lightning makes of Ctrl-C; callers expect the usual.
                raise KeyboardInterrupt from None
        offset = history[-1][0] + 1 if history else 0
        history += [(epoch + offset, error, held_out) for epoch, error, held_out in module.history]
        now, now_validation = _ok(model, train), _ok(model, validation)
        if settled is not None and bool((kept & ~now).any()):
            # Leaving rows out drove others out: it rewards a model that explains less. The fit before stands.
            model.set_vector(settled)
            kept, kept_validation = torch.ones_like(kept), torch.ones_like(kept_validation)
            break
        if torch.equal(now, kept) and torch.equal(now_validation, kept_validation):
            break
        settled = model.vector().detach().clone()
        places = settled[None]
        kept, kept_validation = now, now_validation
        _check_count(model, int(kept.sum()), len(train))
    assert module.algorithm is not None
    return FitOutcome(kept.numpy(), initial, history, module.algorithm.message)


def _ok(model: Model, rows: Rows) -> Tensor:
    with torch.no_grad():
        return model(rows.states).status == Status.OK


def _check_count(model: Model, rows: int, offered: int) -> None:
    parameters = len(model.vector())
    if rows < parameters:
        lost = f" ({offered - rows} of {offered} have no valid prediction)" if offered > rows else ""
        raise UserError(
            f"Model {model.name} has {parameters} parameters but the training set has only {rows} usable rows{lost}: "
            "choose a larger training set or a smaller model."
        )


def _algorithm(problem: Problem, starts: Tensor, options: FitOptions, generator: torch.Generator) -> Algorithm:
    if options.name == LEVENBERG_MARQUARDT:
        return LevenbergMarquardtEpochs(problem, starts, options.max_epochs, options.tolerance)
    if options.name not in OPTIMIZERS:
        known = ", ".join([LEVENBERG_MARQUARDT, *OPTIMIZERS, "none"])
        raise UserError(f"Unknown fit {options.name!r}: choose one of {known}.")
    return GradientEpochs(
        options.name,
        problem,
        starts,
        options.max_epochs,
        options.learning_rate,
        options.batch_size,
        options.weight_decay,
        generator,
    )


def _trainer(folder: Path | None, progress: L.Callback | None) -> L.Trainer:
    # Lightning announces devices and tips at every start; the table at the end says what users need.
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    return L.Trainer(
        max_epochs=-1,
        accelerator="cpu",
        devices=1,
        logger=TensorBoardLogger(folder, name="", version="") if folder else False,
        callbacks=[progress] if progress else None,
        enable_checkpointing=False,
        enable_model_summary=False,
        enable_progress_bar=False,
        log_every_n_steps=1,
        default_root_dir=folder,
    )
