"""The look at a table before a search."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freelearn.api.tasks.search_task import Task
from freelearn.inference.checks.check import TableCheck
from freelearn.inference.checks.look import looked_over
from freelearn.measurements.accuracy import PAPER
from freelearn.measurements.members import members_in
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.effects.registry import EFFECTS

CONTINUUM = "continuum"


def checked(task: Task) -> list[TableCheck]:
    """What an engineer would see in the rows that are looked at.

    The continuum model reads them, whichever is asked about, and without what is known of its parameters: what the
    table holds is looked at, not the model.
    """
    settings, table = task.settings, task.table
    given = [name for name in settings.effects if CONTINUUM in EFFECTS[name].families()]
    samples = [int(n) for n in np.unique(table["sample"])] if settings.per_sample else []
    members = len(members_in(table.columns)) if settings.per_sample else 0

    def build(effects: Sequence[str]) -> Model:
        return build_model(CONTINUUM, {}, effects, samples, members)

    stated = settings.data.accuracy
    return looked_over(table, build, given, PAPER if stated is None else stated.si(), stated is not None)
