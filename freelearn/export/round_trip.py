"""What an export answers beside the fitted model, at thousands of states inside the data and on their edge."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import DEAD_LOAD, DEG, INFLATION, KPA, MM
from freelearn.data.states import States, severity
from freelearn.export.actuator import HISTORY, NEXT, WORST, Actuator
from freelearn.export.along import Follow
from freelearn.queries.inverse.bands import SAME
from freelearn.queries.inverse.system import System

# States that are compared, and of them those with at least one input at the end of its data.
STATES, ON_EDGE = 10_000, 2_000
# States beyond the data, by this share of their span.
OUTSIDE, BEYOND = 500, (0.05, 0.5)
# What is remembered at the states compared: least and most of each.
REMEMBERED = {"clock": (0.0, 1e4), "dwell": (0.0, 600.0), WORST: (0.0, 2.0)}

# Rows of a function's outputs for rows of its inputs: (n, inputs) → (n, outputs).
Answers = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Samples:
    """Inputs of what is known at what an actuator's bed imposes, SI, (n, k): within the data, and beyond them."""

    inside: np.ndarray
    outside: np.ndarray

    @classmethod
    def from_actuator(cls, actuator: Actuator, names: Sequence[str], seed: int = 0, states: int = STATES) -> Samples:
        """Drawn evenly over the box of the data; a fifth of them on its faces, edges and corners. names: of all inputs,
        the imposed ones first."""
        generator = np.random.default_rng(seed)
        low, high = np.array(actuator.domain).T
        x = generator.uniform(low, high, size=(states, len(low)))
        edge = generator.random((states * ON_EDGE // STATES, len(low)))
        # Each input at an end with the chance of a half; where none is, the first.
        at_end = edge < 0.5
        at_end[~at_end.any(1), 0] = True
        x[: len(edge)] = np.where(at_end, np.where(edge < 0.25, low, high), x[: len(edge)])
        span = np.where(high > low, high - low, np.maximum(np.abs(high), 1e-3))
        far = generator.uniform(low, high, size=(OUTSIDE, len(low)))
        which = generator.integers(len(low), size=OUTSIDE)
        slack = actuator.fitted.asker.slack(actuator.system).numpy()
        step = span[which] * generator.uniform(*BEYOND, size=OUTSIDE) + 4 * slack[which]
        up, rows = generator.random(OUTSIDE) < 0.5, np.arange(OUTSIDE)
        far[rows, which] = np.where(up, high[which] + step, low[which] - step)
        span = np.ptp(np.array(actuator.domain), axis=1)
        return cls(*(_remembering(names, at, span, generator) for at in (x, far)))


def _remembering(names: Sequence[str], x: np.ndarray, span: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    columns = [x]
    for name in names[x.shape[1] :]:
        if name.startswith("direction"):
            drawn = generator.integers(-1, 2, size=len(x)).astype(float)
        elif name in ("moved_length", "moved_twist"):
            half = 0.2 * span[0 if name == "moved_length" else 1]
            drawn = generator.uniform(-half, half, size=len(x))
        else:
            drawn = generator.uniform(*REMEMBERED[WORST if name.startswith(WORST) else name], size=len(x))
        columns.append(drawn[:, None])
    return np.concatenate(columns, axis=1)


@dataclass(frozen=True)
class Reference:
    """What the fitted model itself answers, by its own searches. inputs (n, k): by names, the imposed ones first."""

    actuator: Actuator
    inputs: np.ndarray
    names: Sequence[str]

    @cached_property
    def system(self) -> System:
        """Its equations at the inputs."""
        actuator, count = self.actuator, len(self.inputs)
        states = actuator.states[torch.zeros(count, dtype=torch.int64)]
        given = {n: torch.as_tensor(self.inputs[:, i].copy()) for i, n in enumerate(self.names)}
        shared = {p.name: given[p.name] for p in HISTORY if p.name in given}
        each = []
        for i, one in enumerate(states.members or (states,)):
            number = f"_{i + 1}" if states.members else ""
            own = {"direction": given[f"direction{number}"]} if f"direction{number}" in given else {}
            if f"{WORST}{number}" in given:
                now = torch.as_tensor(self.severity(i))
                own |= {"severity": now, "past_severity": torch.maximum(given[f"{WORST}{number}"], now)}
            each.append(one.replace(**shared, **own))
        moved = states.replace(**shared, members=tuple(each)) if states.members else each[0]
        return System(actuator.fitted.model, moved)

    def severity(self, number: int) -> np.ndarray:
        """Of each state, as a table's rows have it, of the member of this number, (n,)."""
        actuator: States = (self.actuator.states.members or (self.actuator.states,))[number]
        columns = {
            "length_mm": float(actuator.reference_length) / MM,
            "inner_radius_mm": float(actuator.inner_radius) / MM,
            "outer_radius_mm": float(actuator.outer_radius) / MM,
            "gamma_deg": float(actuator.fiber_angle) / DEG,
        }
        if actuator.second_angle is not None and actuator.second_share is not None and bool(actuator.second_share[0]):
            columns["gamma2_deg"] = float(actuator.second_angle) / DEG
        x = self.inputs
        table = pd.DataFrame(columns, index=range(len(x))).assign(pressure_kpa=x[:, 2 + number] / KPA)
        if self.actuator.placed:
            table = table.assign(elongation_mm=x[:, 0] / MM, twist_deg=x[:, 1] / DEG)
        return severity(table)

    @cached_property
    def x(self) -> torch.Tensor:
        """Inputs of the equations, (n, m)."""
        count = len(self.actuator.imposed)
        return torch.as_tensor(self.inputs[:, :count].copy()) + self.actuator.rest

    @cached_property
    def answered(self) -> tuple[np.ndarray, np.ndarray]:
        """What is answered (n, 1 or 2), SI, and the status of each (n,)."""
        y, status = self.system.at(self.x)
        return y.numpy()[:, self.actuator.shown], status.numpy()

    @cached_property
    def _at_rest(self) -> tuple[System, torch.Tensor]:
        """Where loads are hung, the equations of loads at a place, and the places."""
        held = self.actuator.held
        assert held is not None
        states = self.system.states.replace(bed=held.bed)
        at = self.actuator.rested(self.x, torch.as_tensor(self.answered[0]))
        return System(self.system.model, states), at

    @cached_property
    def hung(self) -> bool:
        """Whether the answer is a place that was looked for."""
        return self.actuator.bed is DEAD_LOAD and self.actuator.held is not None

    @cached_property
    def outputs(self) -> dict[str, np.ndarray]:
        """Everything that is known there, by the names of the exported outputs."""
        actuator = self.actuator
        y, status = self.answered
        names = [p.name for p in actuator.answered]
        found = {n: y[:, i] for i, n in enumerate(names)} | {"status": status.astype(np.float64)}
        found["inside"] = actuator.reaches(self.x, torch.as_tensor(y)).numpy().astype(np.float64)
        slopes = self.system.slopes(self.x)[1]
        for i, name in enumerate(names):
            for k, port in enumerate(actuator.imposed):
                found[f"d_{name}_by_{port.name}"] = slopes[:, actuator.shown[i], k].numpy()
        if actuator.fitted.bands:
            half = self._half(slopes)
            found |= {f"{n}_half_band": half[:, actuator.shown[i]] for i, n in enumerate(names)}
        for k, name in enumerate(self.names):
            if name.startswith(WORST):
                now = self.severity(int(name.rsplit("_", 1)[1]) - 1 if actuator.states.members else 0)
                found[name.replace(WORST, NEXT)] = np.maximum(self.inputs[:, k], now)
        return found

    def _half(self, slopes: torch.Tensor) -> np.ndarray:
        bands = self.actuator.fitted.bands
        assert bands is not None
        system, x = self.system, self.x
        if self.hung:
            system, x = self._at_rest
            slopes = system.slopes(x)[1]
        inputs, outputs = bands.miss.half_width(system, x, slopes, (0, 1) if self.hung else (), (0, 1), SAME)
        half: np.ndarray = (inputs if self.hung else outputs).numpy()
        if self.actuator.bed is INFLATION and self.actuator.held:
            half = np.c_[half[:, 0], np.full(len(half), bands.diameter)]
        return half


# What float64 leaves of the model's own numbers, as a share of the range: more is no rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Written:
    """files: in the folder, the first the one to use. answers: of its functions, by name; empty where nothing here can
    run them. limit: largest difference allowed, a share of the range. outside: what happens beyond the data. notes:
    what else to know. boxed: whether it knows the ends of each input alone. more: further figures for the certificate;
    broken: which of these are larger than is allowed, in words. follow: along recordings, of what is followed from
    sample to sample."""

    files: list[Path]
    answers: Mapping[str, Answers]
    outside: str
    limit: float = ROUNDING
    boxed: bool = False
    notes: list[str] = field(default_factory=list)
    more: dict[str, Any] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)
    follow: Follow | None = None
