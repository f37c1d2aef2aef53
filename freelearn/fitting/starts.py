"""Where fits begin."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import singledispatch
from typing import Any

import torch
from torch import Tensor

from freelearn.data.error import load_scale, usual_scale
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.models.continuum import Continuum, ContinuumInextensible
from freelearn.physics.models.linear import Linear
from freelearn.physics.models.mlp import HIDDEN, INPUTS, MLP, OUTPUTS

# The positive semidefinite stiffness matrix that fits best: a small convex problem with one global answer.

DIRECTIONS = 720
REFINEMENTS = 40


def best_stiffness(columns: Tensor, target: Tensor) -> tuple[float, float, float]:
    """(ka, kb, kc) with the least ‖columns (ka, kb, kc) − target‖² over K ⪰ 0; columns (m, 3), target (m,).

    Where the unconstrained answer is not positive definite, the constrained one lies on the edge of the cone, and
    so has rank one: K = s v vᵀ with s ≥ 0. For a direction v the best s is known, which leaves one angle to search.
    An entry whose column is zero (kb of an actuator that is never twisted) may come out as anything.
    """
    # Scaled so that both diagonal entries act alike: units must not decide the resolution of the angle.
    unit = columns[:, :2].norm(dim=0).sqrt()
    unit = torch.where(unit > 0, unit, 1.0)
    scale = torch.stack([unit[0] ** 2, unit[1] ** 2, unit[0] * unit[1]])
    triangle = torch.linalg.qr(torch.cat([columns / scale, target[:, None]], dim=1), mode="r").R
    small, goal = triangle[:, :3], triangle[:, 3]
    # The default driver exchanges columns by what it finds in memory that nobody has written: no two runs were alike.
    free = torch.linalg.lstsq(small, goal[:, None], driver="gelsd").solution[:, 0]
    if free[0] > 0 and free[0] * free[1] > free[2] ** 2:
        ka, kb, kc = (free / scale).tolist()
        return ka, kb, kc

    def edge(angle: Tensor) -> tuple[Tensor, Tensor]:
        """Least cost on the ray at each angle, and K there in scaled units: (n,), (n, 3)."""
        x, y = torch.cos(angle), torch.sin(angle)
        ray = torch.stack([x * x, y * y, x * y], dim=-1)
        shown = ray @ small.T
        size = ((shown @ goal) / shown.square().sum(-1).clamp_min(1e-300)).clamp_min(0)
        return (size[:, None] * shown - goal).square().sum(-1), size[:, None] * ray

    low, high = 0.0, math.pi
    for _ in range(REFINEMENTS):
        angles = torch.linspace(low, high, DIRECTIONS, dtype=torch.float64)
        cost, k = edge(angles)
        best = int(cost.argmin())
        width = (high - low) / (DIRECTIONS - 1)
        low, high = float(angles[best]) - width, float(angles[best]) + width
        if width < 1e-15:
            break
    ka, kb, kc = (k[best] / scale).tolist()
    return ka, kb, kc


# Where a fit starts: for each kind of model the raw vectors that are worth starting from.

# Logarithms of C1 and C2 of the grid [Pa]. Rubbers and threads lie within these decades.
START_DECADES = torch.linspace(4, 8, 9, dtype=torch.float64)
# The same for a parameter of which no more is known than its declared start.
AROUND = torch.linspace(-3, 3, 7, dtype=torch.float64)
# With more logarithmic parameters than this a grid has too many places.
MOST_AXES = 3
# A grid is looked at in about this many rows.
START_ROWS = 64
# Smallest and largest shear modulus of a start of the inextensible model [Pa].
START_RANGE = (1e3, 1e9)
# Smallest stiffness of a start [N/m, N·m/rad]: rubber is far stiffer, and the logarithm needs something.
FLOOR = {"ka": 1e-6, "kb": 1e-12}
LN10 = math.log(10.0)


@singledispatch
def starts(model: Model[Any], rows: Rows, members: int, generator: torch.Generator) -> Tensor:
    """Raw vectors from which a fit of training rows may start: at most (members, p), the best first.

    rows: those of training. generator: for what is drawn at random.

    Of a model not known here: its own values, and a grid of its logarithmic parameters from a thousandth to a thousand
    times their declared start, so that a fit does not depend on where its user started. One without such parameters, or
    with more than MOST_AXES, starts at its own values.
    """
    logarithmic = [p for p in (model.declared[own.name] for own in model.parameter_class.records()) if p.log]
    axes = {p.name: (p.to_raw(p.start) + AROUND * LN10).clamp(*p.raw_bounds) for p in logarithmic}
    if not 1 <= len(axes) <= MOST_AXES:
        return _declared(model, members)
    return _grid(model, rows, axes)[:members]


@starts.register
def _continuum(model: Continuum, rows: Rows, members: int, generator: torch.Generator) -> Tensor:
    """The model's own values and a coarse grid of C1 × C2."""
    return _grid(model, rows, dict.fromkeys(("C1", "C2"), START_DECADES * LN10))[:members]


@starts.register
def _linear(model: Linear, rows: Rows, members: int, generator: torch.Generator) -> Tensor:
    """The best K for the present effects, exactly, whatever the model's own K: a fit has only to polish it."""
    rows = rows.as_loads
    states, loads = rows.states, rows.loads
    scale = load_scale(loads)
    values = {name: value.detach() for name, value in model.values().items()}

    def scaled(k: Tensor, at: States = states) -> Tensor:
        named = values | {"ka": k[0], "kb": k[1], "kc": k[2]}
        predicted: Prediction = model(at, named)
        return (predicted.loads / scale).reshape(-1)

    origin = torch.zeros(3, dtype=torch.float64)
    with torch.no_grad():
        fluid: Prediction = model(states, values | dict.fromkeys(("ka", "kb", "kc"), origin[0]))
    told = rows.readings.present & ~rows.readings.slack[:, None] & (fluid.status == Status.OK)[:, None]
    usable = told.reshape(-1)
    target = ((loads - fluid.loads) / scale).reshape(-1)[usable]
    if model.effects:
        columns = torch.func.jacfwd(scaled)(origin)
    else:
        # The wall's loads are linear in K, and without pressure there is nothing else.
        slack = states.replace(pressure=torch.zeros_like(states.pressure))
        columns = torch.stack([scaled(k, slack) for k in torch.eye(3, dtype=torch.float64)], dim=-1)
    best = best_stiffness(columns[usable], target)
    # What the readings do not tell (of twist, where a bed measures force alone) stays as the model has it.
    told_of = (columns[usable] != 0).any(0).tolist()
    own = model.scalars()
    ka, kb, kc = (k if t else own[name] for name, k, t in zip(("ka", "kb", "kc"), best, told_of, strict=True))
    ka, kb = max(ka, FLOOR["ka"]), max(kb, FLOOR["kb"])
    limit = math.sqrt(ka * kb)
    return _at(model, {"ka": ka, "kb": kb, "kc": min(max(kc, -limit), limit)}, members)


@starts.register
def _inextensible(model: ContinuumInextensible, rows: Rows, members: int, generator: torch.Generator) -> Tensor:
    """The best C1 for the present effects: the loads are linear in it."""
    rows = rows.as_loads
    states, loads, scale = rows.states, rows.loads, load_scale(rows.loads)
    values = {name: value.detach() for name, value in model.values().items()}

    def scaled(C1: float) -> Tensor:
        predicted: Prediction = model(states, values | {"C1": torch.tensor(C1, dtype=torch.float64)})
        return (predicted.loads / scale)[usable]

    with torch.no_grad():
        told = rows.readings.present & ~rows.readings.slack[:, None]
        usable = told & (model(states).status == Status.OK)[:, None]
        offset = scaled(0.0)
        column = (scaled(1e6) - offset) / 1e6
        target = (loads / scale)[usable] - offset
        best = float((column @ target) / column.square().sum().clamp_min(1e-300))
    return _at(model, {"C1": min(max(best, START_RANGE[0]), START_RANGE[1])}, members)


@starts.register
def _network(model: MLP, rows: Rows, members: int, generator: torch.Generator) -> Tensor:
    """Nguyen-Widrow starts: the neurons' active ranges spread over the inputs' range (Nguyen & Widrow 1990)."""
    active = int((model.input_gain != 0).sum())
    magnitude = 0.7 * HIDDEN ** (1 / max(active, 1))

    def uniform(*shape: int) -> Tensor:
        return 2 * torch.rand(members, *shape, dtype=torch.float64, generator=generator) - 1

    weight = uniform(HIDDEN, INPUTS) * (model.input_gain != 0)
    weight = magnitude * weight / weight.norm(dim=-1, keepdim=True).clamp_min(1e-12)
    spread = torch.linspace(-1, 1, HIDDEN, dtype=torch.float64)
    bias = magnitude * spread * torch.sign(weight[..., 0] + 1e-300)
    blocks = [weight, bias, uniform(OUTPUTS, HIDDEN), uniform(OUTPUTS)]
    network = torch.cat([b.reshape(members, -1) for b in blocks], dim=1)
    return torch.cat([network, _declared(model, members)[:, network.shape[1] :]], dim=1)


def _declared(model: Model[Any], members: int) -> Tensor:
    """The model's own values, (members, p)."""
    return model.vector().detach().expand(members, -1).clone()


def _at(model: Model[Any], values: dict[str, float], members: int) -> Tensor:
    """The model's own values but for these, (members, p)."""
    raw = model.to_raw(model.scalars() | values)
    vector = torch.stack([raw[name] for name in model.declared])
    return vector.clamp(*model.raw_bounds()).expand(members, -1).clone()


def _grid(model: Model[Any], rows: Rows, axes: Mapping[str, Tensor]) -> Tensor:
    """The model's own raw vector and every place of a grid of raw parameters, the best first: (places, p).

    axes: raw values to try, by the parameter's name. Every place is looked at in a few rows.
    """
    here = model.vector().detach()
    grid = _product(list(axes.values()))
    candidates = torch.cat([here[None], here.expand(len(grid), -1)])
    labels = model.labels()
    candidates[1:, [labels.index(name) for name in axes]] = grid
    candidates = candidates.clamp(*model.raw_bounds())
    some = rows.as_loads[torch.arange(0, len(rows), max(1, len(rows) // START_ROWS))]
    scale = usual_scale(some.readings)
    # All candidates in one batch: every row once for each, with the candidate's values.
    row = torch.arange(len(some)).repeat(len(candidates))
    values = model.physical(candidates.repeat_interleave(len(some), dim=0))
    # Of a log as it is at rest: that tells the decades, and to a few rows' history belong all samples before them.
    of = model.steady if model.remembers(some.states) else model.chain
    with torch.no_grad():
        predicted = of(some.states[row], values).loads
    # The logarithm bounds what a reading that slipped can do (Cauchy's loss).
    misses = some.readings[row].missed(predicted) / scale
    costs = misses.square().log1p().reshape(len(candidates), -1).sum(-1)
    return candidates[costs.nan_to_num(nan=torch.inf).argsort()]


def _product(axes: Sequence[Tensor]) -> Tensor:
    """Every combination of the axes' values, (n, axes)."""
    return torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1).reshape(-1, len(axes))


# A delay is no small thing: its derivative at none tells of the next row alone, so that a few are tried.

DEAD_TIME = "dead_time"
DELAY = f"{DEAD_TIME}.delay"
# The first is a row's, each other one longer by this factor, as far as half a recording goes; rows that are looked at.
LONGER, DELAY_ROWS = 1.5, 4000
# Share of what is left by which another delay must do better.
BETTER = 0.9


def with_delay(model: Model[Any], rows: Rows, vector: Tensor) -> Tensor:
    """A raw start (p,) with the delay among a few, earlier and later, at which the readings of a log follow best.

    What is compared is the least squares of readings over predictions, straight lines between them: a start's stiffness
    need not be right yet."""
    labels, recording = model.labels(), rows.states.recording
    if DELAY not in labels or recording is None or not model.remembers(rows.states):
        return vector
    assert rows.states.place is not None
    run = recording.run[rows.states.place]
    ends = run.unique_consecutive(return_counts=True)[1].cumsum(0)
    some = rows[torch.arange(int(ends[ends <= DELAY_ROWS].max()) if bool((ends <= DELAY_ROWS).any()) else int(ends[0]))]
    place, lower, upper = labels.index(DELAY), *(bound[labels.index(DELAY)] for bound in model.raw_bounds())
    step = float(recording.step[recording.step > 0].median())
    count = int(math.log(max(float(ends[0]) / 2, 1.0)) / math.log(LONGER)) + 1
    each = step * LONGER ** torch.arange(count, dtype=vector.dtype)
    tried = torch.cat([vector[place][None], each, -each])
    tried = tried[(tried >= lower) & (tried <= upper)]
    left = torch.stack([_left(model, some, vector.index_fill(0, torch.tensor(place), float(t))) for t in tried])
    best = int(left.nan_to_num(nan=torch.inf).argmin())
    if not left[best] < BETTER * left[0]:
        return vector
    return vector.index_fill(0, torch.tensor(place), float(tried[best]))


def _left(model: Model[Any], rows: Rows, vector: Tensor) -> Tensor:
    """Share of the readings' variance that straight lines over the predictions leave, (), of both channels together."""
    with torch.no_grad():
        shown = model.chain(rows.states, model.physical(vector)).loads
    left = []
    for i in range(2):
        there = rows.readings.present[:, i] & shown[:, i].isfinite()
        if int(there.sum()) > 2:
            pair = torch.stack([shown[there, i], rows.readings.value[there, i]])
            left.append(1 - torch.corrcoef(pair)[0, 1].nan_to_num(nan=0.0).square())
    return torch.stack(left).mean() if left else torch.tensor(torch.nan)
