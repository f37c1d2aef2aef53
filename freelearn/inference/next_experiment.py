"""Which state to measure next, so that effects which now look alike come apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
import torch

from freelearn.inference.noise import Whitener, sensitivities
from freelearn.inference.step import Step
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.states import States
from freelearn.models.prediction import Status

ELONGATIONS, TWISTS, PRESSURES = 9, 13, 5
# A difference below this many standard deviations of one row is not worth a mounting.
TELLING = 1.0


@dataclass(frozen=True)
class NextState:
    """A state whose measurement is expected to split two effects by expected_z standard deviations of one row."""

    sample: int
    elongation_mm: float
    twist_deg: float
    pressure_kpa: float
    separates: list[str]
    expected_z: float


def reach(table: pd.DataFrame) -> pd.DataFrame:
    """Measurement columns on a grid over all that the bed went to, for each sample; rising pressure."""
    parts = []
    low, high = table.min(numeric_only=True), table.max(numeric_only=True)
    axes = [
        np.linspace(low[name], high[name], count)
        for name, count in (("elongation_mm", ELONGATIONS), ("twist_deg", TWISTS), ("pressure_kpa", PRESSURES))
    ]
    elongation, twist, pressure = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    for _, rows in table.groupby("sample"):
        part = pd.concat([rows.iloc[:1]] * len(elongation), ignore_index=True)
        part["elongation_mm"], part["twist_deg"], part["pressure_kpa"] = elongation, twist, pressure
        # Rows of one state follow each other in rising pressure.
        part["step"] = np.tile(np.arange(PRESSURES), ELONGATIONS * TWISTS)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def next_states(alike: Mapping[str, Step], table: pd.DataFrame, accuracy: Accuracy) -> list[NextState]:
    """The best state for each pair of effects in a class (effect → the model fitted with it), most telling first."""
    grid = reach(table)
    states = States.from_table(grid)
    first = next(iter(alike.values())).fit.model
    # Each row is a visit of its own: its position error is not shared.
    whiten = Whitener(sensitivities(first, states), torch.arange(len(grid)), accuracy)
    predicted = {}
    usable = torch.ones(len(grid), dtype=torch.bool)
    for name, step in alike.items():
        with torch.no_grad():
            predicted[name], status = step.fit.model(states)
        usable &= status == Status.OK
    proposed = []
    for one, other in combinations(alike, 2):
        z = whiten(predicted[one] - predicted[other]).square().sum(-1).sqrt()
        z = torch.where(usable, z, 0.0)
        best = grid.iloc[int(z.argmax())]
        proposed.append(
            NextState(
                int(best["sample"]),
                float(best["elongation_mm"]),
                float(best["twist_deg"]),
                float(best["pressure_kpa"]),
                [one, other],
                float(z.max()),
            )
        )
    return sorted(proposed, key=lambda p: -p.expected_z)


def telling(proposed: Sequence[NextState]) -> tuple[list[NextState], list[str]]:
    """Those states that would tell something, and a sentence for each pair of effects that none would split."""
    useful = [p for p in proposed if p.expected_z >= TELLING]
    twins = [
        f"no state within the bed's reach would tell {' from '.join(p.separates)} (by {p.expected_z:.1f} σ at most)"
        for p in proposed
        if p.expected_z < TELLING
    ]
    return useful, twins
