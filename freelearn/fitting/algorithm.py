"""Algorithms that move a batch of raw vectors, some epochs at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

import torch
from torch import Tensor

from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.optimizers import make_optimizer
from freelearn.fitting.options import Option
from freelearn.fitting.problem import Problem, Pull
from freelearn.fitting.solver import Termination, take


class Algorithm(Protocol):
    """Several members (restarts) that move side by side. epochs: passes over the rows so far."""

    epochs: int

    @property
    def vectors(self) -> Tensor:
        """Where the members stand, (members, p)."""

    def advance(self) -> None:
        """Some more epochs for every member that has not finished."""

    @property
    def finished(self) -> Tensor:
        """Which members have ended, (members,) bool."""

    @property
    def losses(self) -> Tensor:
        """Sum of squared residuals over the training rows, (members,)."""

    def keep(self, member: int) -> bool:
        """Lets only this member go on; False where the others cost next to nothing and stay."""

    def ended(self, member: int) -> tuple[bool, str]:
        """Whether the member came to its own end rather than to a limit, and one sentence on how."""


class LevenbergMarquardtEpochs:
    """One Levenberg-Marquardt iteration an epoch. pull: of what is known beforehand, below the rows' residuals."""

    def __init__(
        self, problem: Problem, start: Tensor, max_epochs: int, tolerance: float, pull: Pull | None = None
    ) -> None:
        lower, upper = (bound.to(start.device) for bound in problem.model.raw_bounds())
        self.problem, self.pull = problem, pull
        self.solver = LevenbergMarquardt(
            *(pull.joined(problem) if pull else (problem.residuals, problem.jacobians)),
            lower=lower,
            upper=upper,
            gtol=tolerance,
            ftol=tolerance,
            xtol=tolerance,
            max_iterations=max_epochs,
            batched=True,
            pieces=(self._pieces if pull else problem.pieces) if problem.parted else None,
        )
        self.state = self.solver.init(start)
        self.epochs = 0

    def _pieces(self, vectors: Tensor) -> Iterator[Tensor]:
        assert self.pull is not None
        yield from self.problem.pieces(vectors)
        yield self.pull.jacobians(vectors)

    def advance(self) -> None:
        """One iteration."""
        self.state = self.solver.step(self.state)
        self.epochs += 1

    def keep(self, member: int) -> bool:
        """See Algorithm."""
        self.state = take(self.state, slice(member, member + 1))
        return True

    @property
    def vectors(self) -> Tensor:
        """See Algorithm."""
        return self.state.x

    @property
    def losses(self) -> Tensor:
        """See Algorithm."""
        return self.state.loss

    @property
    def finished(self) -> Tensor:
        """See Algorithm."""
        return self.state.status != Termination.RUNNING

    def ended(self, member: int) -> tuple[bool, str]:
        """See Algorithm."""
        return Termination(int(self.state.status[member])).converged, self.state.result().message(member)


class GradientEpochs:
    """An optimizer of torch.optim on shuffled batches, all members in one vmapped loss, one-cycle learning rate.

    The optimizers act number by number, so members stacked into one tensor do not influence each other.
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
        options: Mapping[str, Option],
        generator: torch.Generator,
    ) -> None:
        """options: of the optimizer, besides the learning rate. Raises UserError (see make_optimizer)."""
        self.problem, self.batch_size, self.generator = problem, batch_size, generator
        self.max_epochs, self.epochs = max_epochs, 0
        self.lower, self.upper = (bound.to(start.device) for bound in problem.model.raw_bounds())
        self.parameter = start.clone().requires_grad_()
        self.optimizer = make_optimizer(name, self.parameter, {"lr": learning_rate, **options})
        batches = -(-len(problem.rows) // batch_size)
        self.schedule = torch.optim.lr_scheduler.OneCycleLR(
            self.optimizer,
            max_lr=learning_rate,
            total_steps=max_epochs * batches + 1,
            pct_start=0.1,
            # A momentum that the user chose stays as it is.
            cycle_momentum="betas" in self.optimizer.defaults and "betas" not in options,
        )

    def advance(self) -> None:
        """A stride of epochs."""
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

    def keep(self, member: int) -> bool:
        """In one vmapped loss the other members cost next to nothing."""
        return False

    @property
    def vectors(self) -> Tensor:
        """See Algorithm."""
        return self.parameter.detach()

    @property
    def losses(self) -> Tensor:
        """See Algorithm."""
        with torch.no_grad():
            return self.problem.residuals(self.vectors).square().sum(-1)

    @property
    def finished(self) -> Tensor:
        """See Algorithm."""
        members = len(self.parameter)
        return torch.full((members,), self.epochs >= self.max_epochs, device=self.parameter.device)

    def ended(self, member: int) -> tuple[bool, str]:
        """The schedule anneals, so running out of epochs is its plan and no proof of a minimum."""
        return True, f"Ran all {self.epochs} epochs of its schedule."
