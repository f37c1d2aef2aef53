"""Which recording to make next, so that effects which now look alike come apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from freelearn.data.beds import bed_of
from freelearn.data.columns import members_in, pressure_columns
from freelearn.data.rows import Rows
from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.search.next_states import TELLING, NextState
from freelearn.queries.next_measurements.candidates import Limits
from freelearn.queries.next_measurements.courses import course_in_words
from freelearn.queries.next_measurements.goals import Discriminate
from freelearn.queries.next_measurements.known_rows import Known
from freelearn.queries.next_measurements.recordings import (
    INTERVAL,
    Recordings,
    recordings,
    usual_interval,
    usual_rows,
)

# Rows of all candidates that are looked at: less than a plan does, as nobody asked for one.
LOOKED_AT = 40_000
# Where no recording tells that is read as often as those that there are, one that is read so many times as often.
OFTENER = 10


def next_recordings(alike: Mapping[str, Step], table: pd.DataFrame, rows: Rows) -> list[NextState]:
    """The best recording for each pair of effects in a class (effect → the model fitted with it), most telling first.

    table: the rows of a log that were looked at. What it tells is what is left of the difference when the other
    effect's parameters are refitted to old and new rows."""
    step = next(iter(alike.values()))
    known = Known(table, rows, step.fit, step.whiten)
    fits = {name: step.fit for name, step in alike.items()}
    proposed = _best(known, fits, list(combinations(alike, 2)), {})
    if silent := [tuple(p.separates) for p in proposed if p.expected_z < TELLING]:
        interval = usual_interval(table)
        finer = _best(known, fits, silent, {INTERVAL: (interval / OFTENER, interval)})
        better = {tuple(p.separates): p for p in finer}
        proposed = [max(p, better.get(tuple(p.separates), p), key=lambda p: p.expected_z) for p in proposed]
    return sorted(proposed, key=lambda p: -p.expected_z)


def _best(
    known: Known, fits: Mapping[str, WhiteFit], pairs: Sequence[tuple[str, ...]], limits: Limits
) -> list[NextState]:
    """The best recording for each of the pairs, whichever of the two is there."""
    names = {name for pair in pairs for name in pair}
    goal = Discriminate.from_fits([{name: fit for name, fit in fits.items() if name in names}])
    there = recordings(known, goal, usual_rows(known.table), limits, LOOKED_AT)
    allowed = np.flatnonzero(there.objective.visits.allowed[:, 0])
    if not len(allowed):
        return []
    added = zip(there.objective.known, there.objective.each(allowed), strict=True)
    told = there.objective.values([before + more for before, more in added])
    proposed = []
    for pair in pairs:
        both = [value for value, view in zip(told, there.objective.views, strict=True) if set(view.name) == set(pair)]
        least = np.min(both, axis=0)
        best = int(least.argmax())
        proposed.append(_proposed(there, int(allowed[best]), pair, float(least[best]) ** 0.5, bool(limits)))
    return proposed


def _proposed(
    there: Recordings, number: int, separates: Sequence[str], expected_z: float, says_interval: bool
) -> NextState:
    part = there.rows_of(number)
    first, columns = part.iloc[0], pressure_columns(members_in(part.columns))
    highest = tuple(float(part[name].max()) for name in columns)
    imposed = {quantity.column: float(first[quantity.column]) for quantity in bed_of(part).state}
    names = ("elongation_mm", "twist_deg", "force_n", "moment_nmm")
    given: dict[str, Any] = {name: imposed.get(name) for name in names}
    often = f"a row every {usual_interval(part):.2g} s; " if says_interval else ""
    return NextState(
        sample=int(first["sample"]),
        pressure_kpa=float(np.mean(highest)),
        separates=list(separates),
        expected_z=expected_z,
        pressures_kpa=highest if len(columns) > 1 else (),
        course=often + course_in_words(part),
        **given,
    )
