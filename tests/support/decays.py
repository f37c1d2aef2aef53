"""Small models of one's own along the pressure alone, whose profiles can be made by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.fitting.problem import Problem
from freelearn.fitting.profile_line import Squares
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.chain.ports import columns
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.testing.small_tables import random_table

# Pressure that counts as one [Pa].
UNIT = 1e4


class Rate(Parameters):
    A: Tensor = parameter("A", "N", start=1.0)
    k: Tensor = parameter("k", "1", start=1.0, lower=0.0, log=True)


class Decay(Model[Rate]):
    """F = A exp(−k x), x the pressure."""

    name = "decay"
    parameter_class = Rate

    def structure(self, states: States, p: Rate) -> Tensor:
        return alone(p.A * torch.exp(-p.k * states.pressure / UNIT))


class Time(Parameters):
    A: Tensor = parameter("A", "N", start=1.0)
    tau: Tensor = parameter("τ", "1", start=1.0, lower=1e-3, upper=1e3)


class SlowDecay(Model[Time]):
    """The same in τ = 1/k, which is not fitted as a logarithm."""

    name = "slow_decay"
    parameter_class = Time

    def structure(self, states: States, p: Time) -> Tensor:
        return alone(p.A * torch.exp(-states.pressure / UNIT / p.tau))


class Slope(Parameters):
    a: Tensor = parameter("a", "N", start=0.0)
    b: Tensor = parameter("b", "N", start=0.0, lower=0.0, upper=1.0, none=0.0, scale=0.1)


class Line(Model[Slope]):
    """F = a + b x with 0 ≤ b ≤ 1."""

    name = "line"
    parameter_class = Slope

    def structure(self, states: States, p: Slope) -> Tensor:
        return alone(p.a + p.b * states.pressure / UNIT)


class Growth(Parameters):
    A: Tensor = parameter("A", "N", start=1.0, lower=0.0, log=True)
    B: Tensor = parameter("B", "N", start=1.0, lower=0.0, log=True)


class Sum(Model[Growth]):
    """F = A + B x², both positive."""

    name = "sum"
    parameter_class = Growth

    def structure(self, states: States, p: Growth) -> Tensor:
        return alone(p.A + p.B * (states.pressure / UNIT) ** 2)


class Twins(Parameters):
    a: Tensor = parameter("a", "N", start=0.0, lower=-1.0, upper=2.0)
    b: Tensor = parameter("b", "N", start=0.0, lower=-1.0, upper=2.0)
    idle: Tensor = parameter("i", "s", start=3.0)
    lazy: Tensor = parameter("z", "s", start=3.0, lower=0.0, log=True)


class Unidentified(Model[Twins]):
    """F = (a + b) x: neither alone is determined, and of `idle` and `lazy` nothing is."""

    name = "unidentified"
    parameter_class = Twins

    def structure(self, states: States, p: Twins) -> Tensor:
        return alone((p.a + p.b) * states.pressure / UNIT + 0 * (p.idle + p.lazy))


class Wave(Parameters):
    w: Tensor = parameter("ω", "1", start=1.0, lower=0.1, upper=20.0)


class Ripple(Model[Wave]):
    """F = sin(ω x): many minima."""

    name = "ripple"
    parameter_class = Wave

    def structure(self, states: States, p: Wave) -> Tensor:
        return alone(torch.sin(p.w * states.pressure / UNIT))


class Cliff(Decay):
    """A decay that has no answer where k > LIMIT: another load stands there."""

    name = "cliff"
    LIMIT = 0.0

    def structure(self, states: States, p: Rate) -> Prediction:  # type: ignore[override]
        loads = super().structure(states, p)
        lost = (p.k > self.LIMIT) & (states.pressure > 0)
        status = torch.where(lost, Status.NO_EQUILIBRIUM, Status.OK).to(torch.uint8)
        return Prediction(torch.where(lost[:, None], loads + 10, loads), status)


class Rough(Decay):
    """A decay whose load jumps about: no minimum of it is one."""

    name = "rough"

    def structure(self, states: States, p: Rate) -> Tensor:
        return alone(super().structure(states, p)[:, 0] + 0.1 * torch.frac(1e4 * p.k.detach() + 1e3 * p.A.detach()))


def alone(force: Tensor) -> Tensor:
    """Loads without a moment."""
    return columns(force, torch.zeros_like(force))


def forces(x: np.ndarray, force: np.ndarray, state: Sequence[int] | np.ndarray | None = None) -> Rows:
    """Rows at pressures x of which the forces alone were read; state: of each row, its own by default."""
    table = random_table(len(x), 0).assign(pressure_kpa=x * UNIT / 1e3)
    value = torch.as_tensor(np.stack([force, np.zeros(len(x))], axis=1))
    present = torch.tensor([True, False]).expand(len(x), 2).clone()
    states = States.from_table(table)
    readings = Readings(value, present, torch.zeros(len(x), dtype=torch.bool))
    return Rows(states, readings, np.arange(len(x)) if state is None else np.asarray(state))


def fitted(model: Model, rows: Rows) -> Problem:
    """The fit of a model to rows from where it stands, residuals in newtons."""
    problem = Problem(model, rows, torch.ones(2, dtype=torch.float64))
    model.set_vector(Squares.from_problem(problem).least(model.vector().detach()).x)
    return problem
