"""Where a least-squares search stands: its points, its state between steps and its result."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple, TypeVar, cast

from torch import Tensor

from freelearn.fitting.trust_region import LinearModel

Record = TypeVar("Record")


class Termination(IntEnum):
    """How a member of the search stands: still running, or why it stopped."""

    RUNNING = 0
    CONVERGED_GRADIENT = 1
    CONVERGED_LOSS = 2
    CONVERGED_STEP = 3
    NO_PROGRESS = 4
    MAX_ITERATIONS = 5
    INVALID_START = 6

    @property
    def converged(self) -> bool:
        """Whether the member stopped at a minimum, to the tolerances asked for."""
        return self in (Termination.CONVERGED_GRADIENT, Termination.CONVERGED_LOSS, Termination.CONVERGED_STEP)


MESSAGES = {
    Termination.RUNNING: "The search is still running.",
    Termination.CONVERGED_GRADIENT: "Converged: the residuals are orthogonal to every free column of J to gtol.",
    Termination.CONVERGED_LOSS: "Converged: no step can lower the loss by more than ftol or rounding allow.",
    Termination.CONVERGED_STEP: "Converged: the step left to take is below xtol in its effect on the residuals.",
    Termination.NO_PROGRESS: "Stopped without convergence: no step, however short, lowers the loss; the residuals "
    "may be noisy, discontinuous or not finite nearby, or the Jacobian may not be theirs.",
    Termination.MAX_ITERATIONS: "Stopped without convergence: the iteration limit was reached.",
    Termination.INVALID_START: "Not started: the residuals or their Jacobian are not finite at the start.",
}


class Point(NamedTuple):
    """A point x (members, p) with all that is known there.

    `residual` (members, m); `loss` (members,) = ‖r‖², inf where r is not finite; `jacobian` (members, m, p), zero where
    not finite, and without rows where it came in pieces; `norms` (members, p), largest norms of its columns so far;
    `gradient` (members,), largest cosine between r and the columns of free parameters; `size` (members,) = ‖D x‖, D the
    norms of the columns here; `model`, the trust region's view of the Jacobian.
    """

    x: Tensor
    residual: Tensor
    loss: Tensor
    jacobian: Tensor
    norms: Tensor
    gradient: Tensor
    size: Tensor
    model: LinearModel


class Result(NamedTuple):
    """Outcome of a search; the leading axis `members` is absent when a single start (p,) was given.

    `x` (members, p); `loss` (members,) = ‖r‖²; `residual` (members, m) and `jacobian` (members, m, p) at x (without
    rows where it came in pieces);
    `gradient` (members,), largest cosine between r and a free column of J; `status` (members,), `Termination`
    values; `iterations`, trial steps; `evaluations` of the residual; `jacobian_evaluations`.
    """

    x: Tensor
    loss: Tensor
    residual: Tensor
    jacobian: Tensor
    gradient: Tensor
    status: Tensor
    iterations: Tensor
    evaluations: Tensor
    jacobian_evaluations: Tensor

    def member(self, index: int) -> Result:
        """Result of one member alone, without the leading axis."""
        return take(self, index)

    def message(self, index: int = 0) -> str:
        """One sentence on how the member of this index ended."""
        return MESSAGES[Termination(int(self.status.reshape(-1)[index]))]


class State(NamedTuple):
    """Search between two steps: `point`, trust-region `radius`, `status` and counts, each (members,)."""

    point: Point
    radius: Tensor
    status: Tensor
    iterations: Tensor
    evaluations: Tensor
    jacobian_evaluations: Tensor

    @property
    def x(self) -> Tensor:
        """Parameters (members, p)."""
        return self.point.x

    @property
    def loss(self) -> Tensor:
        """Sums of squared residuals (members,)."""
        return self.point.loss

    @property
    def running(self) -> bool:
        """Whether any member still has steps to take."""
        return bool((self.status == Termination.RUNNING).any())

    def result(self) -> Result:
        """What is known now, members leading."""
        at = self.point
        counts = (self.iterations, self.evaluations, self.jacobian_evaluations)
        return Result(at.x, at.loss, at.residual, at.jacobian, at.gradient, self.status, *counts)


def take(record: Record, rows: Tensor | int | slice) -> Record:
    """The given members of a (nested) named tuple of tensors."""
    tree: Any = record
    taken: Any = tree[rows] if isinstance(record, Tensor) else type(tree)(*(take(part, rows) for part in tree))
    return cast(Record, taken)


def put(record: Record, rows: Tensor, members: Record) -> Record:
    """Copy of a (nested) named tuple of tensors with the members of these rows replaced."""
    tree: Any = record
    parts: Any = members
    if isinstance(record, Tensor):
        return cast(Record, tree.index_put((rows,), parts))
    return cast(Record, type(tree)(*(put(part, rows, other) for part, other in zip(tree, parts, strict=True))))
