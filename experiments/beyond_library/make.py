"""Data sets as planned: a laboratory's actuators and protocol, what is hidden sized in σ, and the table with noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from beyond_library.kind import Kind
from beyond_library.truth import Hidden, Truth
from hidden_effects.make import NOISE, SILENT, sized

from freelearn.testing.reference import literature
from freelearn.testing.reference.laboratory import Laboratory, measure_loads, random_actuators

Actuators = dict[int, tuple[float, float, float, float]]
# How near to the size asked for a hidden thing has to be, and how many actuators are tried until it is.
REACHED, TRIES = 0.8, 4


@dataclass(frozen=True)
class Made:
    """A data set. reached: size of what is hidden in σ. told: the accuracy that the search is told, in the table's
    units. slips: how many readings are wrong."""

    table: pd.DataFrame
    truth: Truth
    laboratory: Laboratory
    actuators: Actuators
    reached: float
    told: dict[str, float]
    slips: int

    @property
    def possible(self) -> bool:
        """Whether what is hidden is about as large as asked for; a bound may keep it small."""
        return self.reached >= REACHED


def make(job: dict, kinds: Sequence[Kind]) -> Made:
    """The data set of a plan's entry; kinds: that it hides. `reached`: least share of the size asked for, of each part
    alone."""
    how = job["laboratory"]
    laboratory = Laboratory(**{k: tuple(v) if k == "kinds" else v for k, v in how.items()})
    for attempt in range(TRIES):
        generator = np.random.default_rng([job["seed"], attempt])
        material = float(1e6 * 2 ** generator.uniform(-1, 1)), float(3e7 * 2 ** generator.uniform(-1, 1))
        actuators = random_actuators(job["actuators"], generator)
        plain = Truth(material)
        parts = [_hiding(plain, kind, kind.drawn(generator)) for kind in kinds]
        if job["effect"]:
            parts.append(_having(plain, job["effect"]))
        sizes = [_sized(part, job, material, laboratory, actuators) for part in parts]
        size = min((share for _, share in sizes), default=1.0)
        if size >= REACHED:
            break
    truths = [truth for truth, _ in sizes]
    hidden = tuple(each for truth in truths for each in truth.hidden)
    effects = {name: values for truth in truths for name, values in truth.effects.items()}
    whole = Truth(material, hidden, effects)
    table, slips = measured(laboratory, actuators, whole, NOISE, job["seed"])
    return Made(table, whole, laboratory, actuators, size, laboratory.told(NOISE), slips)


def _hiding(plain: Truth, kind: Kind, shape: Mapping[str, float]) -> Callable[[float], Truth]:
    return lambda amount: replace(plain, hidden=(Hidden(kind, shape, amount),))


def _having(plain: Truth, effect: str) -> Callable[[float], Truth]:
    return lambda amount: replace(plain, effects={effect: literature.grown(effect, amount)} if amount else {})


def _sized(
    at: Callable[[float], Truth], job: dict, material: tuple[float, float], laboratory: Laboratory, actuators: Actuators
) -> tuple[Truth, float]:
    """The truth with what is hidden as large as asked for, and which share of that it reaches. at: amount → truth."""
    quiet = replace(laboratory, slipped=0.0)

    def table(amount: float) -> pd.DataFrame:
        return measured(quiet, actuators, at(amount), SILENT, job["seed"])[0]

    amount, size = sized(table, job["size"], material, NOISE, laboratory.growth)
    return at(amount), size / job["size"] if np.isfinite(size) else 0.0


def measured(
    laboratory: Laboratory, actuators: Actuators, truth: Truth, accuracy: Mapping[str, float], seed: int
) -> tuple[pd.DataFrame, int]:
    """A measurement table and how many of its readings are wrong. accuracy: one standard deviation in its units."""
    table, slips, _, _ = measure_loads(laboratory, actuators, truth.loads, accuracy, seed)
    return table, len(slips)
