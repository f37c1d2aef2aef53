"""The fit as Lightning runs it: its rows, the module that drives it, early stopping, and the trainer."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import lightning as L
import torch
from lightning.pytorch.loggers import TensorBoardLogger
from torch import Tensor
from torch.utils.data import DataLoader

from freelearn.data.rows import Rows
from freelearn.fitting.algorithm import Algorithm
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model

# All training rows and all validation rows.
Batch = tuple[Rows, Rows]


class FitData(L.LightningDataModule):
    """One batch an epoch: every training row and every validation row. The sets are small; algorithms cut their own."""

    def __init__(self, train: Rows, validation: Rows) -> None:
        super().__init__()
        self.batches: list[Batch] = [(train, validation)]

    def train_dataloader(self) -> DataLoader[Batch]:
        """The one batch."""
        # batch_size=None hands the tuple through as it is, without collating rows one by one.
        return DataLoader(self.batches, batch_size=None)  # type: ignore[arg-type]

    def release(self) -> None:
        """Lets the rows go: the trainer, which is kept, holds what it was given."""
        self.batches.clear()

    def transfer_batch_to_device(self, batch: Batch, device: torch.device, dataloader_idx: int) -> Batch:
        """The rows where the model is."""
        train, validation = batch
        return train.to(device), validation.to(device)


# The LightningModule that drives a fit, and the early stopping inside it.

# Share by which a validation error has to fall to count as a gain: without it a network creeps on for hundreds of
# epochs, each better than the last in the fifth digit.
CLEARLY = 1e-3
# How long a training step lets the algorithm run before callbacks hear of it [s]: what Lightning does around a step
# takes longer than an iteration on a few hundred rows.
STRETCH = 0.2

# Makes the algorithm once the training rows are there.
AlgorithmFactory = Callable[[Problem], Algorithm]


class Fitting(L.LightningModule):
    """Fits a model with manual optimization: an algorithm moves a batch of restarts, epoch by epoch.

    Each training step sees all rows (train and validation) and lets the algorithm run a stretch of epochs. The
    best vector of every restart is kept, by validation error where there are validation rows and by training
    error otherwise; a restart whose validation error has not clearly improved for `patience` epochs is done. With
    `race` the restarts run against each other for that many epochs, and only the best one goes on (one rung of
    successive halving, Jamieson & Talwalkar 2016): most of a fit's time would otherwise go into those that lose.

    How many epochs a training step takes depends on the clock, but nothing that a fit returns does.
    """

    def __init__(
        self, model: Model, algorithm: AlgorithmFactory, max_epochs: int, patience: int, race: int | None = None
    ) -> None:
        super().__init__()
        self.automatic_optimization = False
        self.model = model
        self.make_algorithm = algorithm
        self.max_epochs, self.patience, self.race = max_epochs, patience, race
        self.algorithm: Algorithm | None = None
        self.validation: Problem | None = None
        # epoch, training and validation error of the best restart so far.
        self.history: list[tuple[int, float, float]] = []
        # Its vector in each epoch that the logger has not seen.
        self.unlogged: list[Tensor] = []
        self.converged, self.message = False, "not fitted"

    def configure_optimizers(self) -> None:
        """None: the algorithm moves the parameters."""
        return None

    def training_step(self, batch: Batch, batch_index: int) -> None:
        """A stretch of epochs."""
        until = time.monotonic() + STRETCH
        if self.algorithm is None:
            self.algorithm = self._begin(*batch)
            done = self._look(self.algorithm)
        else:
            done = False
        while not done and time.monotonic() < until:
            self.algorithm.advance()
            done = self._look(self.algorithm)
        self._log()
        if done:
            self.trainer.should_stop = True

    def _begin(self, train: Rows, validation: Rows) -> Algorithm:
        self.problem = Problem(self.model, train)
        self.validation = Problem(self.model, validation, self.problem.scale) if len(validation) else None
        algorithm = self.make_algorithm(self.problem)
        self.best = algorithm.vectors.clone()
        self.best_error = torch.full_like(self.best[:, 0], torch.inf)
        # The error at the last clear gain, and its epoch.
        self.milestone = self.best_error.clone()
        self.gain_epoch = torch.zeros_like(self.best_error, dtype=torch.int64)
        return algorithm

    @torch.no_grad()
    def _look(self, algorithm: Algorithm) -> bool:
        """Measures every restart and remembers the best; whether all are done."""
        vectors, epoch = algorithm.vectors, algorithm.epochs
        train = watched = self._error(algorithm.losses, self.problem)
        if self.validation:
            watched = self._error(self.validation.residuals(vectors).square().sum(-1), self.validation)
        better = watched < self.best_error
        self.best = torch.where(better[:, None], vectors, self.best)
        self.best_error = torch.where(better, watched, self.best_error)
        leader = int(self.best_error.argmin()) if len(vectors) > 1 else 0
        self.history.append((epoch, float(train[leader]), float(watched[leader])))
        if self.logger:
            self.unlogged.append(vectors[leader].clone())
        done = algorithm.finished
        if self.validation:
            clearly = watched < (1 - CLEARLY) * self.milestone
            self.milestone = torch.where(clearly, watched, self.milestone)
            self.gain_epoch = torch.where(clearly, epoch, self.gain_epoch)
            done = done | (epoch - self.gain_epoch >= self.patience)
        if bool(done.all()) or epoch >= self.max_epochs:
            self._end(algorithm, leader)
            return True
        if self.race and epoch >= self.race and len(vectors) > 1:
            self._keep(algorithm, leader)
        return False

    def _end(self, algorithm: Algorithm, leader: int) -> None:
        self.converged, self.message = algorithm.ended(leader)
        if self.validation and not bool(algorithm.finished[leader]) and algorithm.epochs < self.max_epochs:
            self.converged = True
            self.message = f"Stopped early: no clearly better validation error in {self.patience} epochs."

    def _keep(self, algorithm: Algorithm, leader: int) -> None:
        """Lets only this restart go on."""
        if algorithm.keep(leader):
            alone = slice(leader, leader + 1)
            self.best, self.best_error = self.best[alone], self.best_error[alone]
            self.milestone, self.gain_epoch = self.milestone[alone], self.gain_epoch[alone]

    @staticmethod
    def _error(losses: Tensor, problem: Problem) -> Tensor:
        return (losses / len(problem.rows)).sqrt().nan_to_num(nan=torch.inf)

    def _log(self) -> None:
        """Tells the logger of the epochs since it was told last."""
        writer = getattr(self.logger, "experiment", None)
        if not self.unlogged or writer is None:
            return
        values = self.model.physical(torch.stack(self.unlogged).cpu())
        for i, (epoch, train, watched) in enumerate(self.history[-len(self.unlogged) :]):
            writer.add_scalar("error_percent/train", 100 * train, epoch)
            if self.validation:
                writer.add_scalar("error_percent/validation", 100 * watched, epoch)
            for name in self.model.declared:
                writer.add_scalar(f"parameter/{name}", float(values[name][i]), epoch)
        self.unlogged.clear()

    def on_train_end(self) -> None:
        """Leaves the best restart's parameters in the model, and of the rows nothing: the trainer is kept."""
        if self.algorithm is not None:
            self.model.set_vector(self.best[int(self.best_error.argmin())])
            self.algorithm = self.validation = None
            del self.problem


# Lightning's trainer, made once and lent to one fit after another.


def run(
    module: L.LightningModule,
    data: L.LightningDataModule,
    folder: Path | None = None,
    progress: L.Callback | None = None,
    device: str = "cpu",
) -> None:
    """Trains the module until it says stop. folder: of TensorBoard's curves. device: cpu or cuda.

    Raises KeyboardInterrupt when the user stops it.
    """
    trainer = _trainer(device)
    # What other packages add to every trainer stays.
    callbacks: list[L.Callback] = trainer.callbacks  # type: ignore[attr-defined]
    trainer.loggers = [TensorBoardLogger(folder, name="", version="")] if folder else []
    trainer.callbacks = [*callbacks, progress] if progress else callbacks  # type: ignore[attr-defined]
    try:
        with warnings.catch_warnings():
            # One batch of everything needs no loader workers; Lightning advises them at every fit.
            warnings.simplefilter("ignore")
            trainer.fit(module, datamodule=data)
    except BaseException as error:
        # A trainer that was interrupted is not used again.
        _trainer.cache_clear()
        if isinstance(error, SystemExit):
            # What Lightning makes of Ctrl-C; callers expect the usual.
            raise KeyboardInterrupt from None
        raise
    finally:
        trainer.loggers = []
        trainer.callbacks = callbacks  # type: ignore[attr-defined]


@lru_cache
def _trainer(device: str) -> L.Trainer:
    """Making one takes longer than a small fit."""
    # Lightning announces devices and tips at every start; the table at the end says what users need.
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    return L.Trainer(
        max_epochs=-1,
        accelerator="gpu" if device == "cuda" else device,
        devices=1,
        logger=False,
        enable_checkpointing=False,
        enable_model_summary=False,
        enable_progress_bar=False,
        log_every_n_steps=1,
    )
