"""Which recording to make next, so that effects which now look alike come apart."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from freelearn.data.beds import bed_of
from freelearn.data.columns import members_in, pressure_columns
from freelearn.data.rows import Rows
from freelearn.discovery.fits.step import Step
from freelearn.discovery.search.next_states import NextState
from freelearn.queries.next_measurements.courses import course_in_words
from freelearn.queries.next_measurements.goals import Discriminate
from freelearn.queries.next_measurements.known_rows import Known
from freelearn.queries.next_measurements.recordings import Recordings, recordings, usual_rows

# Rows of all candidates that are looked at: less than a plan does, as nobody asked for one.
LOOKED_AT = 40_000


def next_recordings(alike: Mapping[str, Step], table: pd.DataFrame, rows: Rows) -> list[NextState]:
    """The best recording for each pair of effects in a class (effect → the model fitted with it), most telling first.

    table: the rows of a log that were looked at. What it tells is what is left of the difference when the other
    effect's parameters are refitted to old and new rows."""
    step = next(iter(alike.values()))
    known = Known(table, rows, step.fit, step.whiten)
    goal = Discriminate.from_fits([{name: step.fit for name, step in alike.items()}])
    there = recordings(known, goal, usual_rows(table), looked_at=LOOKED_AT)
    allowed = np.flatnonzero(there.objective.visits.allowed[:, 0])
    if not len(allowed):
        return []
    told = there.objective.values(
        [m + g for m, g in zip(there.objective.known, there.objective.each(allowed), strict=True)]
    )
    proposed = []
    for pair in combinations(alike, 2):
        # Whichever of the two is there.
        both = [value for value, view in zip(told, there.objective.views, strict=True) if set(view.name) == set(pair)]
        least = np.min(both, axis=0)
        best = int(least.argmax())
        proposed.append(_proposed(there, int(allowed[best]), list(pair), float(least[best]) ** 0.5))
    return sorted(proposed, key=lambda p: -p.expected_z)


def _proposed(there: Recordings, number: int, separates: list[str], expected_z: float) -> NextState:
    part = there.rows_of(number)
    first, columns = part.iloc[0], pressure_columns(members_in(part.columns))
    highest = tuple(float(part[name].max()) for name in columns)
    imposed = {quantity.column: float(first[quantity.column]) for quantity in bed_of(part).state}
    given: dict[str, Any] = {
        name: imposed.get(name) for name in ("elongation_mm", "twist_deg", "force_n", "moment_nmm")
    }
    return NextState(
        sample=int(first["sample"]),
        pressure_kpa=float(np.mean(highest)),
        separates=separates,
        expected_z=expected_z,
        pressures_kpa=highest if len(columns) > 1 else (),
        course=course_in_words(part),
        **given,
    )
