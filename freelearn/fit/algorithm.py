"""Algorithms that move a batch of raw vectors, some epochs at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import torch
from torch import Tensor

from freelearn.fit.levenberg_marquardt import LevenbergMarquardt
from freelearn.fit.problem import Problem
from freelearn.fit.solver import Termination, take

OPTIMIZERS: Mapping[str, Callable[..., torch.optim.Optimizer]] = {
    "adam": torch.optim.Adam,
    "adamw": torch.optim.AdamW,
    "nadam": torch.optim.NAdam,
}


class Algorithm(Protocol):
    """vectors: (members, p), where the members stand. finished: (members,). epochs: passes over the rows so far."""

    epochs: int

    @property
    def vectors(self) -> Tensor: ...

    def advance(self) -> None:
        """Some more epochs for every member that has not finished."""

    @property
    def finished(self) -> Tensor: ...

    @property
    def losses(self) -> Tensor:
        """Sum of squared residuals over the training rows, (members,)."""

    @property
    def message(self) -> str: ...


class LevenbergMarquardtEpochs:
    """One Levenberg-Marquardt iteration an epoch."""

    def __init__(self, problem: Problem, start: Tensor, max_epochs: int, tolerance: float) -> None:
        lower, upper = problem.model.raw_bounds()
        self.solver = LevenbergMarquardt(
            problem.residuals,
            problem.jacobians,
            lower=lower,
            upper=upper,
            gtol=tolerance,
            ftol=tolerance,
            xtol=tolerance,
            max_iterations=max_epochs,
            batched=True,
        )
        self.state = self.solver.init(start)
        self.epochs = 0

    def advance(self) -> None:
        self.state = self.solver.step(self.state)
        self.epochs += 1

    def keep(self, members: Tensor) -> None:
        """Drops all but these members."""
        self.state = take(self.state, members)

    @property
    def vectors(self) -> Tensor:
        return self.state.x

    @property
    def losses(self) -> Tensor:
        return self.state.loss

    @property
    def finished(self) -> Tensor:
        return self.state.status != Termination.RUNNING

    @property
    def message(self) -> str:
        return self.state.result().message(0)


class GradientEpochs:
    """Adam, AdamW or NAdam on shuffled batches, all members in one vmapped loss, with a one-cycle learning rate.

    The optimisers act entry by entry, so members stacked into one tensor do not influence each other.
    The one-cycle schedule (Smith & Topin 2019) warms up and then anneals to almost nothing, so the last epochs
    settle instead of wandering.
    """

    # Epochs between two looks at the validation error.
    STRIDE = 5

    def __init__(
        self,
        name: str,
        problem: Problem,
        start: Tensor,
        max_epochs: int,
        learning_rate: float,
        batch_size: int,
        weight_decay: float,
        generator: torch.Generator,
    ) -> None:
        self.problem, self.batch_size, self.generator = problem, batch_size, generator
        self.max_epochs, self.epochs = max_epochs, 0
        self.lower, self.upper = problem.model.raw_bounds()
        self.parameter = start.clone().requires_grad_()
        options = {"lr": learning_rate} | ({"weight_decay": weight_decay} if weight_decay else {})
        self.optimizer = OPTIMIZERS[name]([self.parameter], **options)
        batches = -(-len(problem.rows) // batch_size)
        self.schedule = torch.optim.lr_scheduler.OneCycleLR(
            self.optimizer, max_lr=learning_rate, total_steps=max_epochs * batches + 1, pct_start=0.1
        )

    def advance(self) -> None:
        for _ in range(min(self.STRIDE, self.max_epochs - self.epochs)):
            order = torch.randperm(len(self.problem.rows), generator=self.generator)
            for rows in order.split(self.batch_size):
                self._step(Problem(self.problem.model, self.problem.rows[rows], self.problem.scale))
            self.epochs += 1

    def _step(self, batch: Problem) -> None:
        self.optimizer.zero_grad(set_to_none=True)

        def loss(vector: Tensor) -> Tensor:
            return batch.residual(vector).square().sum() / len(batch.rows)

        alone = len(self.parameter) == 1
        total = loss(self.parameter[0]) if alone else torch.func.vmap(loss)(self.parameter).sum()
        total.backward()
        self.optimizer.step()
        self.schedule.step()
        with torch.no_grad():
            self.parameter.clamp_(self.lower, self.upper)

    @property
    def vectors(self) -> Tensor:
        return self.parameter.detach()

    @property
    def losses(self) -> Tensor:
        with torch.no_grad():
            return self.problem.residuals(self.vectors).square().sum(-1)

    @property
    def finished(self) -> Tensor:
        return torch.full((len(self.parameter),), self.epochs >= self.max_epochs)

    @property
    def message(self) -> str:
        return f"ran all {self.epochs} epochs"
