"""What a fitted model can be mapped for, how far its bed went, and states without a past to map it at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import BED, DEAD_LOAD, ELONGATION, FORCE, KINEMATIC, MOMENT, TWIST, Bed, Quantity
from freelearn.data.sets import rows_of_set
from freelearn.data.states import States
from freelearn.physics.chain.ports import MeasurementEffect
from freelearn.queries.curves.curve_rows import pressures
from freelearn.queries.fitted_model import FittedModel

# How far a run's bed went: the plane and the pressures over which a fitted model is mapped.

Ends = tuple[float, float]


@dataclass(frozen=True)
class OperatingRange:
    """Lowest and highest of all samples' rows, as the bed's reach (next_states). elongation: mm; twist:
    °; low, high: of each actuator's pressure, (k,) kPa; quantities: these pressures."""

    elongation: Ends
    twist: Ends
    quantities: tuple[Quantity, ...]
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def from_predictions(cls, predictions: pd.DataFrame) -> OperatingRange:
        """Of a run's rows: columns of predictions.csv. What was neither imposed nor measured is as predicted."""
        several = pressures(predictions)
        imposed = predictions[[quantity.column for quantity in several]].to_numpy(np.float64)
        return cls(
            _ends(predictions, ELONGATION), _ends(predictions, TWIST), several, imposed.min(axis=0), imposed.max(axis=0)
        )

    def nearest(self, elongation_mm: float, twist_deg: float) -> tuple[float, float]:
        """The place within the plane that is nearest to one."""
        ends = np.array([self.elongation, self.twist])
        near = np.clip((elongation_mm, twist_deg), ends[:, 0], ends[:, 1])
        return float(near[0]), float(near[1])


def _ends(predictions: pd.DataFrame, quantity: Quantity) -> Ends:
    for name in (quantity.column, quantity.predicted):
        if name in predictions and predictions[name].notna().any():
            return float(predictions[name].min()), float(predictions[name].max())
    return 0.0, 0.0


# What a row remembers of how it was reached, and of when.
WAY = ("direction", "clock", "dwell", "moved_length", "moved_twist")


def steady_states(fitted: FittedModel, rows: pd.DataFrame, bed: Bed) -> States:
    """States of a run's actuators as they are once the bed has stood still: no friction, no drift, nothing relaxed.

    Their rubber is worn as the run left it: the worst that an actuator has been to is the worst of the run's rows, or
    the state itself. rows: sample, the actuators' pressures, and force_n and moment_nmm under a dead load, else
    elongation_mm and twist_deg.
    """
    table = rows.merge(fitted.design, on="sample", how="left", validate="many_to_one")
    more: dict[str, float | str | pd.Series] = {"step": 0, BED: bed.name}
    if fitted.members:
        more["pressure_kpa"] = table[list(fitted.columns.pressures)].mean(axis=1)
    states, past = States.from_table(table.assign(**more)), States.from_table(fitted.table())
    each = tuple(_still(now, then) for now, then in zip(states.members, past.members, strict=True))
    return _still(states, past).replace(members=each)


def _still(states: States, past: States) -> States:
    """The states without a way that led there, worn as the past states of the same actuators left them."""
    worn: Tensor = states.severity.clone()
    for number in states.sample.unique():
        worst = past.past_severity[past.sample == number].max()
        worn = torch.where(states.sample == number, torch.maximum(worn, worst), worn)
    return states.replace(past_severity=worn, **{name: torch.zeros_like(getattr(states, name)) for name in WAY})


# What a fitted model can be mapped for: which loads or poses, of which samples, and what a reader should know.


def tells_loads(fitted: FittedModel) -> bool:
    """Whether the model knows force and moment at a place: a network does only where it was fitted to them."""
    return fitted.model.family != "mlp" or fitted.bed is KINEMATIC


def tells_poses(fitted: FittedModel) -> bool:
    """Whether the model knows where an end comes to rest under a load."""
    return tells_loads(fitted) or fitted.bed is DEAD_LOAD


def refused(fitted: FittedModel) -> UserError:
    """What is said where it does not."""
    return UserError(
        f"A network knows nothing but what it was fitted to, here what the bed {fitted.bed.name} measures, which is no "
        "such map: fit another model."
    )


def samples_known(fitted: FittedModel, asked: Sequence[int] | None) -> list[int]:
    """The samples asked for, all of the run's by default. Raises UserError for one that the run does not have."""
    known = [int(number) for number in fitted.design["sample"]]
    unknown = sorted(set(asked or ()) - set(known))
    if unknown:
        raise UserError(f"The run has no sample {unknown[0]}: it has {', '.join(map(str, known))}.")
    return known if asked is None else list(asked)


def fitted_samples(fitted: FittedModel, predictions: pd.DataFrame) -> tuple[int, ...]:
    """Samples of the run's training set; all where nothing was fitted. predictions: fitted.table()."""
    train = str(fitted.run.content["train"])
    return tuple(int(n) for n in sorted(rows_of_set(predictions, train)["sample"].unique()))


def load_notes(fitted: FittedModel) -> list[str]:
    """Whose the loads are, where they are not plainly what the actuator carries and what was measured."""
    notes = []
    known = {q.name for q in (*fitted.bed.measured, *fitted.bed.state)}
    lacking = [q.name for q in (FORCE, MOMENT) if q.name not in known]
    if lacking:
        notes.append(f"The run knew no {' and no '.join(lacking)}: of it the model alone speaks.")
    sensors = [effect.name for effect in fitted.model.effects if isinstance(effect, MeasurementEffect)]
    if sensors:
        notes.append(f"Loads are those that the run's sensors show ({', '.join(sensors)}).")
    return notes


def lost_note(points: pd.DataFrame, why: str) -> list[str]:
    """How many rows a map leaves out; nothing where it has all. points: with `status`."""
    lost = int((points["status"] != "ok").sum())
    return [f"{lost} of {len(points)} points are left out: {why}."] if lost else []
