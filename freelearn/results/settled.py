"""States without a past, at which a fitted model is mapped."""

from __future__ import annotations

import pandas as pd
import torch
from torch import Tensor

from freelearn.measurements.beds import BED, Bed
from freelearn.measurements.states import States
from freelearn.results.fitted_model import FittedModel

# What a row remembers of how it was reached, and of when.
WAY = ("direction", "clock", "dwell", "moved_length", "moved_twist")


def settled(fitted: FittedModel, rows: pd.DataFrame, bed: Bed) -> States:
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
