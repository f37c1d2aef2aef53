"""What an export answers beside the fitted model, at thousands of states inside the data and on their edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import DEG, KPA, MM
from freelearn.data.states import severity
from freelearn.export.actuator import HISTORY, Actuator
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.system import System

# States that are compared, and of them those with at least one input at the end of its data.
STATES, ON_EDGE = 10_000, 2_000
# States beyond the data, by this share of their span.
OUTSIDE, BEYOND = 500, (0.05, 0.5)
# What is remembered at the states compared: least and most of each.
REMEMBERED = {"clock": (0.0, 1e4), "dwell": (0.0, 600.0), "worst_severity": (0.0, 2.0)}

# Rows of a function's outputs for rows of its inputs: (n, inputs) → (n, outputs).
Answers = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Samples:
    """Inputs of the function `loads`, SI, (n, k). inside: those within the data. seed: that drew them."""

    inside: np.ndarray
    outside: np.ndarray

    @classmethod
    def from_actuator(cls, actuator: Actuator, seed: int = 0, states: int = STATES) -> Samples:
        """Drawn evenly over the box of the data; a fifth of them on its faces, edges and corners."""
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
        step = span[which] * generator.uniform(*BEYOND, size=OUTSIDE) + 4 * _slack(actuator)[which]
        up, rows = generator.random(OUTSIDE) < 0.5, np.arange(OUTSIDE)
        far[rows, which] = np.where(up, high[which] + step, low[which] - step)
        return cls(_remembering(actuator, x, generator), _remembering(actuator, far, generator))


def _slack(actuator: Actuator) -> np.ndarray:
    slack: np.ndarray = actuator.fitted.asker.slack(actuator.system).numpy()
    return slack


def _remembering(actuator: Actuator, x: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    columns = [x]
    span = np.ptp(np.array(actuator.domain), axis=1)
    for port in actuator.forward.inputs[x.shape[1] :]:
        if port.name.startswith("direction"):
            drawn = generator.integers(-1, 2, size=len(x)).astype(float)
        elif port.name in ("moved_length", "moved_twist"):
            half = 0.2 * span[0 if port.name == "moved_length" else 1]
            drawn = generator.uniform(-half, half, size=len(x))
        else:
            drawn = generator.uniform(*REMEMBERED[port.name], size=len(x))
        columns.append(drawn[:, None])
    return np.concatenate(columns, axis=1)


@dataclass(frozen=True)
class Reference:
    """What the fitted model itself answers at inputs of `loads`, by its own searches."""

    actuator: Actuator
    inputs: np.ndarray

    @cached_property
    def system(self) -> System:
        """Its equations at the inputs."""
        actuator, count = self.actuator, len(self.inputs)
        states = actuator.system.states[torch.zeros(count, dtype=torch.int64)]
        names = [p.name for p in actuator.forward.inputs]
        given = {n: torch.as_tensor(self.inputs[:, i].copy()) for i, n in enumerate(names)}
        shared = {p.name: given[p.name] for p in HISTORY[:4] if p.name in given}
        if "worst_severity" in given:
            now = torch.as_tensor(self.severity)
            shared |= {"severity": now, "past_severity": torch.maximum(given["worst_severity"], now)}
        members = tuple(
            m.replace(**shared, **({"direction": given[f"direction_{i}"]} if f"direction_{i}" in given else {}))
            for i, m in enumerate(states.members, start=1)
        )
        directed = {"direction": given["direction"]} if "direction" in given else {}
        return System(actuator.fitted.model, states.replace(members=members, **shared, **directed))

    @property
    def severity(self) -> np.ndarray:
        """Of each state, as a table's rows have it."""
        states, count = self.actuator.states, len(self.inputs)
        columns = {
            "length_mm": float(states.reference_length) / MM,
            "inner_radius_mm": float(states.inner_radius) / MM,
            "outer_radius_mm": float(states.outer_radius) / MM,
            "gamma_deg": float(states.fiber_angle) / DEG,
        }
        if states.second_angle is not None and states.second_share is not None and bool(states.second_share[0]):
            columns["gamma2_deg"] = float(states.second_angle) / DEG
        x = self.inputs
        table = pd.DataFrame(columns, index=range(count)).assign(
            elongation_mm=x[:, 0] / MM, twist_deg=x[:, 1] / DEG, pressure_kpa=x[:, 2] / KPA
        )
        return severity(table)

    @cached_property
    def x(self) -> torch.Tensor:
        """Inputs of the equations, (n, m)."""
        count = len(self.actuator.imposed)
        return torch.as_tensor(self.inputs[:, :count].copy()) + self.actuator.rest

    @cached_property
    def answered(self) -> tuple[np.ndarray, np.ndarray]:
        """What is answered (n, 2), SI, and the status of each (n,)."""
        y, status = self.system.at(self.x)
        return y.numpy(), status.numpy()


@dataclass(frozen=True)
class Difference:
    """states: compared; on_edge of them. settled: those with an answer. largest: difference of each answer as a share
    of its range, by name. ranges: these, SI. statuses: rows whose status differs. flagged: share of the states
    beyond the data that were told as such."""

    states: int
    on_edge: int
    settled: int
    largest: dict[str, float]
    ranges: dict[str, float]
    statuses: int
    outside: int
    flagged: float
    worst: dict[str, float]
    shares: np.ndarray

    @property
    def most(self) -> float:
        """The largest of all."""
        return max(self.largest.values())


def compared(actuator: Actuator, answers: Answers, samples: Samples) -> Difference:
    """An export's answers beside the model's own. answers: those of the function `loads`."""
    loads = actuator.functions[0]
    place = {p.name: i for i, p in enumerate(loads.outputs)}
    got, (want, status) = answers(samples.inside), Reference(actuator, samples.inside).answered
    settled = (status != int(Status.NO_EQUILIBRIUM)) & np.isfinite(want).all(1)
    ranges = np.ptp(want[settled], axis=0)
    shares = np.abs(got[:, :2] - want)[settled] / np.where(ranges > 0, ranges, 1.0)
    # What is not a number is as far off as can be.
    shares = np.where(np.isnan(shares), np.inf, shares)
    names = [p.name for p in actuator.answered]
    flags = answers(samples.outside)[:, place["inside"]] == 0
    worst = samples.inside[settled][shares.max(1).argmax()]
    edges = len(samples.inside) * ON_EDGE // STATES
    return Difference(
        states=len(samples.inside),
        on_edge=edges,
        settled=int(settled.sum()),
        largest=dict(zip(names, shares.max(0).tolist(), strict=True)),
        ranges=dict(zip(names, ranges.tolist(), strict=True)),
        statuses=int((got[:, place["status"]] != status).sum()) if "status" in place else 0,
        outside=len(samples.outside),
        flagged=float(flags.mean()),
        worst=dict(zip((p.name for p in loads.inputs), worst.tolist(), strict=True)),
        shares=shares,
    )


# What float64 leaves of the model's own numbers, as a share of the range: more is no rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Written:
    """files: in the folder, the first the one to use. answers: of its function `loads`, None where nothing here can run
    it. limit: largest difference allowed, a share of the range. outside: what happens beyond the data. notes: what else
    to know. more: further figures for the certificate."""

    files: list[Path]
    answers: Answers | None
    outside: str
    limit: float = ROUNDING
    notes: list[str] = field(default_factory=list)
    more: dict[str, Any] = field(default_factory=dict)
