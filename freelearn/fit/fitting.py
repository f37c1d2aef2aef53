"""The LightningModule that drives a fit, and the early stopping inside it."""

from __future__ import annotations

from collections.abc import Callable

import lightning as L
import torch
from torch import Tensor

from freelearn.fit.algorithm import Algorithm, LevenbergMarquardtEpochs
from freelearn.fit.batches import Batch
from freelearn.fit.problem import Problem
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model

# Share by which a validation error has to fall to count as a gain: without it a network creeps on for hundreds of
# epochs, each better than the last in the fifth digit.
CLEARLY = 1e-3

# Makes the algorithm once the training rows are there.
AlgorithmFactory = Callable[[Problem], Algorithm]


class Fitting(L.LightningModule):
    """Fits a model with manual optimisation: an algorithm moves a batch of restarts, epoch by epoch.

    Each training step sees all rows (train and validation) and lets the algorithm run a stretch of epochs. The
    best vector of every restart is kept, by validation error where there are validation rows and by training
    error otherwise; a restart whose validation error has not clearly improved for `patience` epochs is done. With
    `race` the restarts run against each other for that many epochs, and only the best one goes on (one rung of
    successive halving, Jamieson & Talwalkar 2016): most of a fit's time would otherwise go into those that lose.
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
        # epoch, training and validation error of the best restart so far.
        self.history: list[tuple[int, float, float]] = []

    def configure_optimizers(self) -> None:
        return None

    def training_step(self, batch: Batch, batch_index: int) -> None:
        train, validation = batch
        if self.algorithm is None:
            self._begin(train, validation)
        else:
            self.algorithm.advance()
        self._look()

    def _begin(self, train: Rows, validation: Rows) -> None:
        self.problem = Problem(self.model, train)
        self.held_out = Problem(self.model, validation, self.problem.scale) if len(validation) else None
        self.algorithm = self.make_algorithm(self.problem)
        members = len(self.algorithm.vectors)
        self.best = self.algorithm.vectors.clone()
        self.best_error = torch.full((members,), torch.inf, dtype=torch.float64)
        # The error at the last clear gain, and its epoch.
        self.milestone = self.best_error.clone()
        self.gain_epoch = torch.zeros(members, dtype=torch.int64)

    @torch.no_grad()
    def _look(self) -> None:
        """Measures every restart, remembers the best, and stops when all are done."""
        assert self.algorithm is not None
        vectors, epoch = self.algorithm.vectors, self.algorithm.epochs
        train = self._error(self.algorithm.losses, self.problem)
        held_out = train
        if self.held_out:
            held_out = self._error(self.held_out.residuals(vectors).square().sum(-1), self.held_out)
        better = held_out < self.best_error
        self.best[better] = vectors[better]
        self.best_error[better] = held_out[better]
        clearly = held_out < (1 - CLEARLY) * self.milestone
        self.milestone[clearly] = held_out[clearly]
        self.gain_epoch[clearly] = epoch
        leader = int(self.best_error.argmin())
        self.history.append((epoch, float(train[leader]), float(held_out[leader])))
        self._log(leader)
        stale = (epoch - self.gain_epoch >= self.patience) if self.held_out else torch.zeros_like(better)
        if bool((stale | self.algorithm.finished).all()) or epoch >= self.max_epochs:
            self.trainer.should_stop = True
        elif self.race and epoch >= self.race and len(vectors) > 1:
            self._keep(leader)

    def _keep(self, leader: int) -> None:
        """Lets only this restart go on. Gradient algorithms have none to win: there members cost next to nothing."""
        if not isinstance(self.algorithm, LevenbergMarquardtEpochs):
            return
        alone = torch.tensor([leader])
        self.algorithm.keep(alone)
        self.best, self.best_error = self.best[alone], self.best_error[alone]
        self.milestone, self.gain_epoch = self.milestone[alone], self.gain_epoch[alone]

    @staticmethod
    def _error(losses: Tensor, problem: Problem) -> Tensor:
        return (losses / len(problem.rows)).sqrt().nan_to_num(nan=torch.inf)

    def _log(self, leader: int) -> None:
        if not (self.logger and hasattr(self.logger, "experiment")):
            return
        epoch, train, held_out = self.history[-1]
        writer = self.logger.experiment
        writer.add_scalar("error/train", train, epoch)
        if self.held_out:
            writer.add_scalar("error/validation", held_out, epoch)
        values = self.model.physical(self.algorithm.vectors[leader])  # type: ignore[union-attr]
        for name in self.model.declared:
            writer.add_scalar(f"parameter/{name}", float(values[name]), epoch)

    def on_train_end(self) -> None:
        """Leaves the best restart's parameters in the model."""
        if self.algorithm is not None:
            self.model.set_vector(self.best[int(self.best_error.argmin())])
