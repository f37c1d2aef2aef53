"""What a fitted model can be mapped for: which loads or poses, of which samples, and what a reader should know."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.beds import DEAD_LOAD, FORCE, KINEMATIC, MOMENT
from freelearn.measurements.sets import rows_of_set
from freelearn.models.ports import MeasurementEffect
from freelearn.results.fitted_model import FittedModel


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
