"""How well a model fits a table plainly, and the same table read otherwise: quickly, on some of its rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD, bed_of
from freelearn.data.rows import Rows
from freelearn.discovery.checks.grid_search import GRID_ROWS, gridded, shares, thinned, usual
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.priors import raw_prior, spans

Build = Callable[[Sequence[str]], Model]
# Rows of a quick fit at most: E of a hundred is known to a tenth.
MOST_ROWS = 120
# Noise of a quick fit as a share of the usual readings, and the residual, in these, from which a reading's pull falls.
SHARE, FAR = 0.03, 3.0
ROUNDS, STEPS, TOLERANCE = 2, 10, 1e-4
# Zooms of the grid, and of one that is only looked through.
ZOOMS, LOOKED = 3, 1


@dataclass(frozen=True)
class PlainFit:
    """E: root of the summed mean squares of both channels, each as a share of its largest readings, without the few
    largest residuals. channels: the same of each channel, NaN where nothing was read. answered: share of the rows that
    the model has loads for. values: parameters by label, SI. stiff, soft: how many times C1 or C2 is above the highest,
    or below the lowest, that rubbers and threads have; one where it is within."""

    E: float
    channels: tuple[float, float]
    answered: float
    values: dict[str, float]
    stiff: float = 1.0
    soft: float = 1.0


HOPELESS = PlainFit(float("inf"), (float("inf"), float("inf")), 0.0, {})


@dataclass(frozen=True)
class Plain:
    """Plain fits of a model with given effects to a table (its units and columns). build: effects → fresh model with a
    C1 and a C2."""

    build: Build
    given: Sequence[str]
    table: pd.DataFrame

    @cached_property
    def some(self) -> pd.DataFrame:
        """Evenly spread rows of the table, by which other readings of it are compared."""
        count = len(self.table)
        place = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).round().astype(np.int64))
        return self.table.iloc[place].reset_index(drop=True)

    @cached_property
    def itself(self) -> PlainFit:
        """Of the table as it stands."""
        return self.of(self.table)

    @cached_property
    def channels(self) -> tuple[float, float]:
        """Of the table as it stands, as in PlainFit. Under a dead load from equilibria, which a grid does without: at a
        place that is far off the stiffness there tells little."""
        bed = bed_of(self.table)
        if bed is not DEAD_LOAD or not np.isfinite(self.itself.E):
            return self.itself.channels
        rows = thinned(Rows.from_table(self.table), GRID_ROWS)
        model = self.build(self.given)
        model.set_values(self.itself.values)
        with torch.no_grad():
            shown = model(rows.states)
        missed = torch.where((shown.status == Status.OK)[:, None], rows.readings.missed(shown.loads), torch.nan)
        each = shares(missed / usual(rows), rows)
        least = [min(one, other) for one, other in zip(self.itself.channels, each.tolist(), strict=True)]
        return least[0], least[1]

    def model(self, rows: Rows, values: Mapping[str, float]) -> Model:
        """The model with these values by label, SI, ready for rows."""
        model = self.build(self.given)
        model.prepare(rows)
        model.set_values(values)
        return model

    def of(self, table: pd.DataFrame, more: Sequence[str] = (), roughly: bool = False) -> PlainFit:
        """Of the table as read otherwise, or of a model with more effects. E is infinite where there is no fit.

        roughly: only to be compared with others; parameters other than C1 and C2 stay as they start."""
        try:
            with np.errstate(all="ignore"):
                rows = thinned(Rows.from_table(table), MOST_ROWS)
            return fitted(self.build([*self.given, *more]), rows, roughly)
        except (UserError, ArithmeticError, ValueError, RuntimeError):
            # A reading that leaves no length, say, has no fit: the other readings do.
            return HOPELESS


def fitted(model: Model, rows: Rows, roughly: bool = False) -> PlainFit:
    """A quick fit of a model to rows (N): of a grid, from which all parameters move on but under a dead load."""
    model.prepare(rows)
    found = gridded(model, rows, LOOKED if roughly else ZOOMS)
    as_found = PlainFit(found.E, found.channels, found.answered, *_values(model, found.vector))
    if roughly or rows.states.bed is DEAD_LOAD:
        return as_found
    moved = _moved_on(model, rows, found.vector)
    return moved if moved.E < as_found.E else as_found


def _moved_on(model: Model, rows: Rows, vector: Tensor) -> PlainFit:
    """By bounded least squares from a raw vector (p,)."""
    prior, scale, present = raw_prior(model, spans(rows)), usual(rows), rows.readings.present
    problem = Problem(model, rows, torch.ones(2, dtype=torch.float64))
    root, middle = prior.root, prior.middle
    for _ in range(ROUNDS):
        missed = problem.residual(vector).detach().reshape(-1, 2) / scale
        sizes = missed.abs().nan_to_num(1.0, 1.0).clamp_min(FAR * SHARE)
        weight = torch.where(present, (FAR * SHARE / sizes).sqrt(), 0.0) / scale / SHARE

        def residuals(vectors: Tensor, weight: Tensor = weight) -> Tensor:
            white = problem.residuals(vectors).reshape(len(vectors), -1, 2) * weight
            return torch.cat([white.flatten(1), (vectors - middle) @ root.T], dim=1)

        def jacobians(vectors: Tensor, weight: Tensor = weight) -> Tensor:
            white = problem.jacobians(vectors).reshape(len(vectors), -1, 2, vectors.shape[1]) * weight[..., None]
            return torch.cat([white.flatten(1, 2), root.expand(len(vectors), -1, -1)], dim=1)

        vector = _sought(model, residuals, jacobians, vector)
    model.set_vector(vector)
    with torch.no_grad():
        answered = float((model(problem.states).status == Status.OK).double().mean())
    each = shares(problem.residual(vector).detach().reshape(-1, 2) / scale, rows)
    pair = float(each[0]), float(each[1])
    return PlainFit(float(each.square().nansum().sqrt()), pair, answered, *_values(model, vector))


def _sought(
    model: Model, residuals: Callable[[Tensor], Tensor], jacobians: Callable[[Tensor], Tensor], start: Tensor
) -> Tensor:
    lower, upper = model.raw_bounds()
    solver = LevenbergMarquardt(
        residuals, jacobians, lower=lower, upper=upper, gtol=TOLERANCE, ftol=TOLERANCE, xtol=TOLERANCE,
        max_iterations=STEPS, batched=True,
    )  # fmt: skip
    state = solver.init(start[None])
    while state.running:
        state = solver.step(state)
    return state.result().member(0).x.detach().clone()


def _values(model: Model, vector: Tensor) -> tuple[dict[str, float], float, float]:
    """Parameters, and how far C1 and C2 are from what is known of them."""
    with torch.no_grad():
        physical = model.physical(vector)
    values = {name: float(physical[name]) for name in model.declared}
    ranges = {name: model.declared[name].plausible({}) for name in ("C1", "C2")}
    stiff = max(1.0, *(values[name] / high for name, (_, high) in ranges.items()))
    soft = max(1.0, *(low / max(values[name], 1e-300) for name, (low, _) in ranges.items()))
    return values, stiff, soft
