"""What a fitted model missed where it did not see: residuals of rows that its fit left out, or as if it had."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, FORCE, MOMENT
from freelearn.data.rows import Rows
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import groups
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.system import System

# More rows tell no more of how far a model misses; whole kinematic states are drawn. Of logs as many recordings as have
# so many samples, which are followed, and rows evenly from them all: recordings tell, and not their rows.
MOST_ROWS, MOST_SAMPLES = 3000, 30_000
# Without one of few kinematic states a fit may end far off: then it is made in earnest, not by one linearized step.
FEW_STATES, ITERATIONS = 12, 15


@dataclass(frozen=True)
class HeldOutRows:
    """n rows with what the equations y = f(x) miss there.

    system: of the rows, at their places; slopes (n, 2, m): derivatives of the outputs there. residual (n, 2): f(x) − y
    by a fit without the row's kinematic state; known (n, 2) bool: where one was measured. under_load: whether what was
    measured is the place x₁, x₂ and not y: then `known` says which of the two, and the residual is what its error makes
    of y. recording: of rows of a log the number of theirs, (n,) int64."""

    system: System
    slopes: Tensor
    residual: Tensor
    known: Tensor
    under_load: bool
    recording: Tensor | None = None

    def __len__(self) -> int:
        return len(self.system)


def held_out(model: Model, rows: Rows, fitted: Tensor, by_states: bool) -> HeldOutRows:
    """Residuals of rows of which the fit saw some, (N,) bool: a row that it saw is left out, with its kinematic state,
    by one Gauss-Newton step (see Cook & Weisberg 1982), which is exact for models linear in their parameters. Of a
    network, which is not near that, the rows that it did not see speak alone, where there are any.

    by_states: whether the next measurement may be of a state that was not visited. It matters where few were: then
    each state is left out by a fit of its own, or else only single rows are.
    """
    usable = _answered(model, rows)
    if model.needs_validation and bool((usable & ~fitted).any()):
        usable = usable & ~fitted
    log = rows.states.recording is not None
    place = _drawn(rows.state, usable.numpy(), MOST_SAMPLES if log else MOST_ROWS)
    place = place[:: max(1, -(-len(place) // MOST_ROWS))] if log else place
    some, seen = rows[place], fitted[place]
    problem = Problem(model, some)
    vector = model.vector().detach()
    with torch.no_grad():
        residual = problem.residual(vector).reshape(-1, 2)
    if not model.needs_validation:
        few = len(np.unique(some.state)) <= FEW_STATES
        # The next measurement of a log is another recording.
        by_states = by_states or log
        if few and by_states:
            residual = _refitted(problem, vector, residual, seen)
        else:
            group = np.arange(len(some)) if few else some.state
            residual = _without_own(problem, vector, residual, seen, group)
    residual = residual * problem.scale
    shown = problem.readings(vector)
    known = some.readings.present & some.readings.informative_mask(shown)
    system = System.placed(model, some.states, shown)
    _, slopes = system.slopes(system.x)
    under_load = some.states.bed is DEAD_LOAD and system.mechanical
    if under_load:
        residual = -(slopes[:, :, :2] @ residual[..., None])[..., 0]
    elif system.mechanical and some.states.bed.readings != (FORCE, MOMENT):
        # A diameter is no load.
        known = known & torch.tensor([q is FORCE for q in some.states.bed.readings])
        residual = torch.where(known, residual, 0.0)
    recording = torch.as_tensor(groups(some.state)) if log else None
    return HeldOutRows(system, slopes, residual, known, under_load, recording)


def _answered(model: Model, rows: Rows) -> Tensor:
    with torch.no_grad():
        status: Tensor = model(rows.states).status
    return (status == Status.OK) & rows.readings.present.any(-1)


def _drawn(state: np.ndarray, usable: np.ndarray, most: int) -> Tensor:
    """Usable rows, at most so many, of as many whole states as may be, evenly drawn: (n,) int64."""
    names = np.unique(state[usable])
    share = most / max(int(usable.sum()), 1)
    if share < 1:
        names = names[np.linspace(0, len(names) - 1, max(int(share * len(names)), 1)).round().astype(int)]
    return torch.as_tensor(np.flatnonzero(usable & np.isin(state, names)))


def _refitted(problem: Problem, vector: Tensor, residual: Tensor, seen: Tensor) -> Tensor:
    """As `_without_own` for kinematic states, by a fit without each. Of a single state nothing can be said so."""
    rows, model = problem.rows, problem.model
    residual, (lower, upper) = residual.clone(), model.raw_bounds()
    for name in np.unique(rows.state):
        own = torch.as_tensor(rows.state == name)
        rest = Problem(model, rows[seen & ~own], problem.scale)
        if 2 * len(rest.rows) <= len(vector) or not bool((own & seen).any()):
            continue
        solver = LevenbergMarquardt(
            rest.residuals, rest.jacobians, lower=lower, upper=upper, max_iterations=ITERATIONS, batched=True
        )
        moved = solver.solve(vector[None]).member(0).x
        with torch.no_grad():
            left = Problem(model, rows[own & seen], problem.scale).residual(moved)
        residual[own & seen] = left.reshape(-1, 2)
    return residual


def _without_own(problem: Problem, vector: Tensor, residual: Tensor, seen: Tensor, group: np.ndarray) -> Tensor:
    """Residuals (n, 2) in the fit's own units, of rows that were seen by a fit without their group, (n,)."""
    each = problem.jacobians(vector[None])[0].reshape(len(residual), 2, -1)
    part = torch.where(seen[:, None, None], each, 0.0)
    normal = part.flatten(0, 1).T @ part.flatten(0, 1)
    length = normal.diagonal().sqrt().clamp_min(1e-300)
    names, number = np.unique(group, return_inverse=True)
    of = torch.as_tensor(number)
    count = each.shape[2]
    scaled = part / length
    blocks = torch.zeros(len(names), count, count, dtype=each.dtype)
    blocks.index_add_(0, of, scaled.transpose(1, 2) @ scaled)
    slope = torch.zeros(len(names), count, dtype=each.dtype).index_add_(0, of, (scaled * residual[:, :, None]).sum(1))
    rest = normal / length / length[:, None] - blocks
    step = (torch.linalg.pinv(rest, hermitian=True, rtol=1e-12) @ slope[..., None])[..., 0] / length
    return residual + torch.where(seen[:, None], (each @ step[of][..., None])[..., 0], 0.0)
