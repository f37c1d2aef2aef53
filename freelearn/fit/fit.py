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

from freelearn.data.module import FitData
from freelearn.errors import UserError
from freelearn.fit.algorithm import OPTIMIZERS, Algorithm, GradientEpochs, LevenbergMarquardtEpochs
from freelearn.fit.fitting import Fitting
from freelearn.fit.problem import Problem, Rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status

LEVENBERG_MARQUARDT = "levenberg_marquardt"
# Most rounds in which the rows of the loss may change.
ROUNDS = 8


@dataclass(frozen=True)
class FitOptions:
    """How to fit. restarts: members fitted side by side, the best kept. patience: epochs without a better
    validation error before a member stops. The last four belong to the gradient algorithms."""

    name: str
    max_epochs: int
    restarts: int
    patience: int
    tolerance: float = 1e-10
    learning_rate: float = 1e-2
    batch_size: int = 128
    weight_decay: float = 0.0


@dataclass(frozen=True)
class FitOutcome:
    """kept: training rows that took part, (N,) bool. start: raw vector (p,) the winner began at. history: epoch,
    training and validation error. module: the Lightning module, for its checkpoint."""

    kept: np.ndarray
    start: Tensor
    history: list[tuple[int, float, float]]
    message: str
    trainer: L.Trainer


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

    Rows for which the model has no answer (no equilibrium, singular, overstretched) stay out of the loss: first
    those of the start, then, round by round, those of the solution, until the set agrees with itself. Within a round
    the set is fixed, and a row that loses its equilibrium on the way keeps the finite loads of its bound, so
    driving rows out is never a way to lower the loss.
    """
    generator = torch.Generator().manual_seed(seed)
    model.prepare(train.states, train.loads)
    starts = model.starts(train.states, train.loads, options.restarts if model.needs_restarts else 1, generator)
    start = starts[0].clone()
    model.set_vector(start)
    kept, held = _ok(model, train), _ok(model, validation)
    history: list[tuple[int, float, float]] = []
    for attempt in range(ROUNDS):
        _check_count(model, int(kept.sum()), len(train))
        make = partial(_algorithm, starts=starts, options=options, generator=generator)
        module = Fitting(model, make, options.max_epochs, options.patience)
        trainer = _trainer(folder, progress)
        with warnings.catch_warnings():
            # One batch of everything needs no loader workers; Lightning advises them at every fit.
            warnings.simplefilter("ignore")
            trainer.fit(module, datamodule=FitData(train[kept], validation[held]))
        offset = history[-1][0] + 1 if history else 0
        history += [(epoch + offset, error, held_out) for epoch, error, held_out in module.history]
        starts = model.vector().detach()[None]
        now, now_held = _ok(model, train), _ok(model, validation)
        if torch.equal(now, kept) and torch.equal(now_held, held):
            break
        # Rows may come back while the parameters settle; in the last rounds they only leave, so that this ends.
        settle = attempt >= ROUNDS // 2
        kept, held = (now & kept, now_held & held) if settle else (now, now_held)
    assert module.algorithm is not None
    return FitOutcome(kept.numpy(), start, history, module.algorithm.message, trainer)


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
