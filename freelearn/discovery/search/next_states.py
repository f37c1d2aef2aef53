"""Which state to measure next, so that effects which now look alike come apart."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.common.formats import listed
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import ELONGATION, FORCE, KPA, MOMENT, TWIST, bed_of
from freelearn.data.columns import members_in, pressure_columns
from freelearn.data.states import States
from freelearn.discovery.fits.step import Step
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.physics.chain.prediction import Status

# Places along the two quantities of a kinematic state (elongation and twist), and along the pressure.
FIRSTS, SECONDS, PRESSURES = 9, 13, 5
# A difference below this many standard deviations of one row is not worth a mounting.
TELLING = 1.0


@dataclass(frozen=True)
class NextState:
    """A state whose measurement is expected to split two effects by expected_z standard deviations of one row.

    elongation_mm, twist_deg: None on a bed that does not impose them; force_n, moment_nmm: on one that does. pressures:
    of each actuator on one end block. course: of a recording, what is done in it, in words; the pressures are then the
    highest of it, and the rest is where it begins."""

    sample: int
    elongation_mm: float | None
    twist_deg: float | None
    pressure_kpa: float
    separates: list[str]
    expected_z: float
    force_n: float | None = None
    moment_nmm: float | None = None
    pressures_kpa: tuple[float, ...] = ()
    course: str = ""


def reach(
    table: pd.DataFrame, pressures_each: int = PRESSURES, limits: Mapping[str, tuple[float, float]] | None = None
) -> pd.DataFrame:
    """Measurement columns on a grid over all that the bed went to, for each sample; rising pressure.

    pressures_each: of every place, whose rows follow each other. limits: column → lowest and highest that the bed can
    impose, where it can do more or less than it went to."""
    parts = []
    low, high = table.min(numeric_only=True), table.max(numeric_only=True)
    for name, ends in (limits or {}).items():
        low[name], high[name] = ends
    first, second = (quantity.column for quantity in bed_of(table).state)
    # An end block's actuators are inflated one at a time, or all at once.
    pressures = list(pressure_columns(members_in(table.columns)))
    alone = [[name] for name in pressures] if len(pressures) > 1 else []
    axes = [np.linspace(low[name], high[name], n) for name, n in ((first, FIRSTS), (second, SECONDS))]
    share = np.linspace(0, 1, pressures_each)
    places = [a.ravel() for a in np.meshgrid(*(np.unique(axis) for axis in axes), share, indexing="ij")]
    for _, rows in table.groupby("sample"):
        for inflated in [*alone, pressures]:
            part = pd.concat([rows.iloc[:1]] * len(places[0]), ignore_index=True)
            part[first], part[second] = places[:2]
            for name in pressures:
                part[name] = low[name] + places[2] * ((high[name] - low[name]) if name in inflated else 0.0)
            if len(pressures) > 1:
                part["pressure_kpa"] = part[pressures].mean(axis=1)
            # Rows of one state follow each other in rising pressure.
            part["step"] = np.tile(np.arange(pressures_each), len(part) // pressures_each)
            parts.append(part)
    return pd.concat(parts, ignore_index=True)


def next_states(alike: Mapping[str, Step], table: pd.DataFrame, accuracy: Accuracy) -> list[NextState]:
    """The best state for each pair of effects in a class (effect → the model fitted with it), most telling first."""
    grid = reach(table)
    # A state as it is once the bed has stood still.
    still = torch.zeros(len(grid), dtype=torch.float64)
    states = States.from_table(grid).replace(moved_length=still, moved_twist=still)
    first = next(iter(alike.values())).fit.model
    # Each row is a visit of its own: its position error is not shared.
    whiten = Whitener(sensitivities(first, states), torch.arange(len(grid)), accuracy, bed=states.bed)
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
        proposed.append(next_state(states, int(z.argmax()), [one, other], float(z.max())))
    return sorted(proposed, key=lambda p: -p.expected_z)


def next_state(states: States, row: int, separates: list[str], expected_z: float) -> NextState:
    """One of some states, proposed."""
    imposed: dict[str, Any] = dict.fromkeys(q.column for q in (ELONGATION, TWIST, FORCE, MOMENT))
    inputs = states.inputs()
    for quantity, value in zip(states.bed.state, inputs[:2], strict=True):
        here = value[row] - (states.reference_length[row] if quantity is ELONGATION else 0.0)
        imposed[quantity.column] = float(here / quantity.factor)
    return NextState(
        sample=int(states.sample[row]),
        pressure_kpa=float(states.pressure[row] / KPA),
        separates=separates,
        expected_z=expected_z,
        pressures_kpa=tuple(float(p[row] / KPA) for p in inputs[2:]) if states.members else (),
        **imposed,
    )


def telling(proposed: Sequence[NextState], what: str = "state") -> tuple[list[NextState], list[str]]:
    """Those states that would tell something, and sentences of the effects that none would split, many in one. what: a
    state, or a recording."""
    useful = [p for p in proposed if p.expected_z >= TELLING]
    alike = {frozenset(p.separates): p.expected_z for p in proposed if p.expected_z < TELLING}
    order = list(dict.fromkeys(name for p in proposed for name in p.separates))
    sentences = []
    for group in _alike(order, alike):
        pairs = [frozenset(pair) for pair in combinations(group, 2)]
        told = f"{listed(group)} from each other" if len(group) > 2 else " from ".join(group)
        sentences.append(_twins(what, told, [alike.pop(pair) for pair in pairs]))
    for name in order:
        if others := [other for other in order if frozenset([name, other]) in alike and other != name]:
            most = [alike.pop(frozenset([name, other])) for other in others]
            sentences.append(_twins(what, f"{name} from {listed(others)}", most))
    return useful, sentences


def _alike(order: Sequence[str], pairs: Collection[frozenset[str]]) -> list[list[str]]:
    """Groups of effects of which any two are such a pair, each effect in the first that it fits in."""
    groups = list[list[str]]()
    for name in order:
        fits = (group for group in groups if all(frozenset([name, other]) in pairs for other in group))
        group = next(fits, None)
        if group is None:
            groups.append([name])
        else:
            group.append(name)
    return [group for group in groups if len(group) > 1]


def _twins(what: str, told: str, sigmas: Sequence[float]) -> str:
    return f"no {what} within the bed's reach would tell {told} (by {max(sigmas):.1f} σ at most)"
