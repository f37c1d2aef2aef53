"""What a fitted model missed where it did not see: residuals of rows that its fit left out, or as if it had."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, FORCE, MOMENT
from freelearn.data.rows import Rows
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem, Pull
from freelearn.fitting.uncertainty import groups
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.raw_covariance import RawCovariance
from freelearn.queries.inverse.system import System
from freelearn.records.left_out_readings import LeftOutReadings

# More rows tell no more of how far a model misses; whole kinematic states are drawn. Of logs as many recordings as have
# so many samples, which are followed, and rows evenly from them all: recordings tell, and not their rows.
MOST_ROWS, MOST_SAMPLES = 3000, 30_000
# Without one of few kinematic states a fit may end far off: then it is made in earnest, not by one linearized step.
FEW_STATES, ITERATIONS = 12, 15
# Directions of the parameters that tell less than this share of the strongest one's count as told nothing of.
RANK = 1e-12


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
    state: Tensor | None = None
    by_parameters: Tensor | None = None

    def __len__(self) -> int:
        return len(self.system)


def held_out(
    model: Model,
    rows: Rows,
    fitted: Tensor,
    by_states: bool,
    parameters: RawCovariance,
    left: LeftOutReadings | None = None,
) -> HeldOutRows:
    """Residuals of rows of which the fit saw some, (N,) bool: a row that it saw is left out, with its kinematic state,
    by one Gauss-Newton step (see Cook & Weisberg 1982), which is exact for models linear in their parameters. Of a
    network, which is not near that, the rows that it did not see speak alone, where there are any.

    by_states: whether the next measurement may be of a state that was not visited. It matters where few were: then
    each state is left out by a fit of its own, or else only single rows are. parameters: how well the fit knows them.

    left: of the rows, from a search, which has left out each state with what it knew of the parameters beforehand: then
    nothing is fitted.
    """
    usable = _answered(model, rows)
    if left is not None:
        usable = usable & left.missed.isfinite().any(-1)
    if model.needs_validation and bool((usable & ~fitted).any()):
        usable = usable & ~fitted
    log = rows.states.recording is not None
    place = _drawn(rows.state, usable.numpy(), MOST_SAMPLES if log else MOST_ROWS)
    place = place[:: max(1, -(-len(place) // MOST_ROWS))] if log else place
    some, seen = rows[place], fitted[place]
    problem = Problem(model, some)
    vector = model.vector().detach()
    with torch.no_grad():
        residual = problem.residual(vector).reshape(-1, 2) * problem.scale
    known_by: Tensor | None = None
    few = len(np.unique(some.state)) <= FEW_STATES
    # The next measurement of a log is another recording.
    by_states = by_states or log
    if left is not None:
        residual, stderr = (told.nan_to_num(0.0) for told in left.of(place))
        known_by = torch.diag_embed(stderr.square())
    elif not model.needs_validation:
        alone = few and not by_states
        without = _Without(problem, vector, residual, seen, np.arange(len(some)) if alone else some.state)
        residual = without.refitted() if few and by_states else without.residual()
        known_by = None if parameters.silent else without.by_parameters(parameters)
    shown = problem.readings(vector)
    known = some.readings.present & some.readings.informative_mask(shown)
    system = System.placed(model, some.states, shown)
    _, slopes = system.slopes(system.x)
    under_load = some.states.bed is DEAD_LOAD and system.mechanical
    if under_load:
        by_place = slopes[:, :, :2]
        residual = -(by_place @ residual[..., None])[..., 0]
        known_by = None if known_by is None else by_place @ known_by @ by_place.mT
    elif system.mechanical and some.states.bed.readings != (FORCE, MOMENT):
        # A diameter is no load.
        known = known & torch.tensor([q is FORCE for q in some.states.bed.readings])
        residual = torch.where(known, residual, 0.0)
    number = torch.as_tensor(groups(some.state))
    apart = few and by_states and not log and not model.needs_validation
    return HeldOutRows(
        system, slopes, residual, known, under_load, number if log else None, number if apart else None, known_by
    )


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


class _Without:
    """Fits without each of some groups of rows. residual (n, 2) SI, at the fit's vector (p,); seen, group: (n,)."""

    def __init__(self, problem: Problem, vector: Tensor, residual: Tensor, seen: Tensor, group: np.ndarray) -> None:
        self.problem, self.vector, self.seen, self.group = problem, vector, seen, group
        self.at, self.pull = residual / problem.scale, Pull.from_problem(problem, vector)

    def refitted(self) -> Tensor:
        """Residuals (n, 2) SI by a fit without each kinematic state. Of a single state nothing can be said so."""
        problem, rows, model, pull = self.problem, self.problem.rows, self.problem.model, self.pull
        residual, (lower, upper) = self.at.clone(), model.raw_bounds()
        for name in np.unique(rows.state):
            own = torch.as_tensor(rows.state == name)
            rest = Problem(model, rows[self.seen & ~own], problem.scale)
            few = pull is None and 2 * len(rest.rows) <= len(self.vector)
            if few or not bool((own & self.seen).any()):
                continue
            functions = pull.joined(rest) if pull else (rest.residuals, rest.jacobians)
            solver = LevenbergMarquardt(*functions, lower=lower, upper=upper, max_iterations=ITERATIONS, batched=True)
            moved = solver.solve(self.vector[None]).member(0).x
            with torch.no_grad():
                left = Problem(model, rows[own & self.seen], problem.scale).residual(moved)
            residual[own & self.seen] = left.reshape(-1, 2)
        return residual * problem.scale

    @cached_property
    def rates(self) -> Tensor:
        """∂residual/∂vector, (n, 2, p), in the fit's own units."""
        return self.problem.jacobians(self.vector[None])[0].reshape(len(self.at), 2, -1)

    @cached_property
    def number(self) -> Tensor:
        """Each row's group as 0, 1, …, (n,)."""
        return torch.as_tensor(np.unique(self.group, return_inverse=True)[1])

    @cached_property
    def normal(self) -> Tensor:
        """JᵀJ of what the fit saw and knew, (p, p)."""
        part = self.rates[self.seen].flatten(0, 1)
        normal = part.T @ part
        return normal if self.pull is None else normal + self.pull.root.T @ self.pull.root

    @cached_property
    def length(self) -> Tensor:
        """Of the columns, (p,)."""
        return self.normal.diagonal().sqrt().clamp_min(1e-300)

    @cached_property
    def scaled(self) -> Tensor:
        """Rates at column length one, zero of rows that the fit did not see."""
        return torch.where(self.seen[:, None, None], self.rates, 0.0) / self.length

    @cached_property
    def blocks(self) -> Tensor:
        """JᵀJ of each group alone, at column length one: (groups, p, p)."""
        count = len(self.vector)
        blocks = torch.zeros(int(self.number.max()) + 1, count, count, dtype=self.at.dtype)
        return blocks.index_add_(0, self.number, self.scaled.mT @ self.scaled)

    def residual(self) -> Tensor:
        """Residuals (n, 2) SI, of rows that were seen by a fit without their group, to first order."""
        slope = torch.zeros(len(self.blocks), len(self.vector), dtype=self.at.dtype)
        slope.index_add_(0, self.number, (self.scaled * self.at[:, :, None]).sum(1))
        rest = self.normal / self.length / self.length[:, None] - self.blocks
        step = (torch.linalg.pinv(rest, hermitian=True, rtol=RANK) @ slope[..., None])[..., 0] / self.length
        moved = (self.rates @ step[self.number][..., None])[..., 0]
        return (self.at + torch.where(self.seen[:, None], moved, 0.0)) * self.problem.scale

    def by_parameters(self, parameters: RawCovariance) -> Tensor:
        """What the parameters' uncertainty makes of each row by the fit without its group: (n, 2, 2) SI. A state to
        which the others have to be extrapolated is missed by more.

        With H the share of a group in JᵀJ, the covariance grows by (1 − H)^-½ from either side, which of independent
        errors is the textbook's σ² (JᵀJ)⁻¹ of the other rows.
        """
        size, axes = torch.linalg.eigh(self.normal / self.length / self.length[:, None])
        strong = size > RANK * size.max()
        root = (axes * torch.where(strong, size, 0.0).sqrt()) @ axes.T
        inverse = (axes * torch.where(strong, size, torch.inf).rsqrt()) @ axes.T
        rest, turned = torch.linalg.eigh(torch.eye(len(size), dtype=size.dtype) - inverse @ self.blocks @ inverse)
        grown = inverse @ (turned * rest.clamp_min(RANK).rsqrt()[:, None, :]) @ turned.mT @ root / self.length[:, None]
        grown = grown * self.length
        each = torch.where(
            self.seen[:, None, None], (grown @ parameters.matrix @ grown.mT)[self.number], parameters.matrix
        )
        by = self.rates * self.problem.scale[:, None]
        return by @ each @ by.mT
