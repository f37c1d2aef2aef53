"""The LightningModule that drives a fit, and the early stopping inside it."""

from __future__ import annotations

import time
from collections.abc import Callable

import lightning as L
import torch
from torch import Tensor

from freelearn.fitting.algorithm import Algorithm
from freelearn.fitting.batches import Batch
from freelearn.fitting.problem import Problem
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model

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
