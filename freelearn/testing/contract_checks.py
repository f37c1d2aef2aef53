"""What a model with any effects must keep: plain assertions, which the contract classes call, in any units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.discovery.noise.noise import sensitivities
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Prediction, Status

# Units as exponents of length, force and time, and a change of all three.

# Exponents of length, force and time.
UNITS = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "K": (0, 0, 0),
    "m": (1, 0, 0),
    "s": (0, 0, 1),
    "Hz": (0, 0, -1),
    "N": (0, 1, 0),
    "J": (1, 1, 0),
    "Pa": (-2, 1, 0),
}
# New sizes of the units: lengths come out this many times as large, forces, times.
SIZES = (1.7, 0.6, 2.3)


def factor(unit: str) -> float:
    """How many times as large a number in this unit becomes with SIZES.

    A unit is a product and at most one quotient of UNITS, with exponents: N·m/rad, rad/(N·m), N/m², 1/s.

    >>> factor("N·m/rad") == 1.7 * 0.6
    True

    Raises AssertionError for what is none.
    """
    above, _, below = unit.partition("/")
    value = 1.0
    for side, sign in ((above, 1), (below.strip("()"), -1)):
        for part in filter(None, side.split("·")):
            match = re.fullmatch(r"([A-Za-z1]+?)(⁻?[²³¹⁶])?", part)
            assert match, f"{unit!r} is no unit that can be changed: use {', '.join(UNITS)}"
            assert match[1] in UNITS, f"{match[1]!r} in {unit!r} is no unit that can be changed: use {', '.join(UNITS)}"
            power = sign * _power(match[2] or "")
            for size, exponent in zip(SIZES, UNITS[match[1]], strict=True):
                value *= size ** (exponent * power)
    return value


def _power(text: str) -> int:
    size = {"": 1, "¹": 1, "²": 2, "³": 3, "⁶": 6}[text.lstrip("⁻")]
    return -size if text.startswith("⁻") else size


def rescaled(states: States) -> States:
    """The same states in the new units."""
    length, pressure, time = factor("m"), factor("Pa"), factor("s")
    lengths = ("reference_length", "inner_radius", "outer_radius", "length", "moved_length")
    changed = {name: length * getattr(states, name) for name in lengths}
    changed |= {"pressure": pressure * states.pressure, "clock": time * states.clock, "dwell": time * states.dwell}
    other = states.replace(**changed)
    if states.recording is None:
        return other
    whole = states.recording
    return other.replace(recording=replace(whole, states=rescaled(whole.states), time=time * whole.time))


# What a model with any effects must keep: plain assertions, which the contract classes call.

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
    """Derivatives by length, twist and pressure agree with differences: along a log by those of whole recordings, and
    by the pressure of a row by itself."""
    slopes = sensitivities(model, states)
    for i, (name, h) in enumerate(STEPS.items()):
        with torch.no_grad():
            up, down = (model(_moved(states, name, s * h, name != "pressure")).loads for s in (1, -1))
        expected = (up - down) / (2 * h)
        torch.testing.assert_close(
            slopes[:, :, i], expected, rtol=1e-5, atol=1e-6 * float(expected.abs().max()) + 1e-12
        )


def _moved(states: States, name: str, by: float, whole: bool) -> States:
    """States (N,) of which one quantity is another. whole: with the recordings that they belong to."""
    moved = states.replace(**{name: getattr(states, name) + by})
    if states.recording is None or not whole:
        return moved
    behind = _moved(states.recording.states, name, by, False)
    return moved.replace(recording=states.recording.with_states(behind))


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
