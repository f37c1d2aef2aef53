"""What a model with any effects must keep: plain assertions, which the contract classes call."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.fitting.problem import Problem
from freelearn.inference.noise import sensitivities
from freelearn.measurements.rows import Readings, Rows
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.prediction import Prediction, Status

# Steps of difference quotients: [m], [rad], [Pa].
STEPS = {"length": 1e-6, "twist": 1e-5, "pressure": 1.0}


def parameter_derivatives(model: Model[Any], states: States, steps: Mapping[str, float]) -> None:
    """Forward and reverse derivatives by all raw parameters agree, and with differences in the steps' labels."""
    rows = Rows(states, Readings.whole(torch.ones(len(states), 2, dtype=torch.float64)), np.arange(len(states)))
    problem = Problem(model, rows)
    vector = model.vector().detach()
    reverse = problem.jacobians(vector[None])[0]
    forward = torch.func.jacfwd(problem.residual)(vector)
    torch.testing.assert_close(forward, reverse, rtol=1e-8, atol=1e-9 * float(reverse.abs().max()))
    for label, size in steps.items():
        column = model.labels().index(label)
        step = torch.zeros_like(vector)
        step[column] = size
        with torch.no_grad():
            slope = (problem.residual(vector + step) - problem.residual(vector - step)) / (2 * size)
        scale = float(slope.abs().max())
        torch.testing.assert_close(reverse[:, column], slope, rtol=1e-4, atol=1e-6 * scale)


def state_derivatives(model: Model[Any], states: States) -> None:
    """Derivatives by length, twist and pressure agree with differences."""
    slopes = sensitivities(model, states)
    for i, (name, h) in enumerate(STEPS.items()):
        here = getattr(states, name)
        with torch.no_grad():
            up, down = (model(states.replace(**{name: here + s * h})).loads for s in (1, -1))
        expected = (up - down) / (2 * h)
        torch.testing.assert_close(
            slopes[:, :, i], expected, rtol=1e-5, atol=1e-6 * float(expected.abs().max()) + 1e-12
        )


def batch_is_rows(model: Model[Any], states: States) -> None:
    """No row's loads depend on another row."""
    with torch.no_grad():
        rows = torch.cat([model(states[slice(i, i + 1)]).loads for i in range(0, len(states), 8)])
        torch.testing.assert_close(model(states).loads[::8], rows, rtol=1e-9, atol=1e-9)


def members_are_alone(model: Model[Any], states: States) -> None:
    """Several raw vectors at once (vmap), and one per row, give what each gives alone."""
    vector = model.vector().detach()
    vectors = vector * torch.tensor([[1.0], [1.01]], dtype=torch.float64)

    def loads(one: Tensor) -> Tensor:
        predicted: Prediction = model(states, model.physical(one))
        return predicted.loads

    with torch.no_grad():
        together, alone = torch.func.vmap(loads)(vectors), torch.stack([loads(v) for v in vectors])
        torch.testing.assert_close(together, alone, rtol=1e-9, atol=1e-9)
        spread = model.chain(states, model.physical(vector.expand(len(states), -1))).loads
    torch.testing.assert_close(spread, alone[0], rtol=1e-9, atol=1e-9)


def reciprocal(model: Model[Any], states: States) -> None:
    """∂F/∂φ = ∂M/∂l at fixed pressure: wall, fluid and springs give back the work that is put in."""
    with torch.no_grad():
        assert (model(states).status != Status.NO_EQUILIBRIUM).all()
    slopes = sensitivities(model, states)
    scale = float(slopes[:, :, :2].abs().max())
    torch.testing.assert_close(slopes[:, 0, 1], slopes[:, 1, 0], rtol=1e-7, atol=1e-7 * min(scale, 1e3))
