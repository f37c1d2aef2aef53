"""What a plan is chosen from, and the choice: rows of mountings, or of a log whole recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import pandas as pd

from freelearn.api.settings.run_settings import MOST_ROWS, PlanSettings
from freelearn.common.errors import UserError
from freelearn.data.logs import is_log
from freelearn.data.states import kinematic_state
from freelearn.discovery.search.next_states import TELLING
from freelearn.queries.next_measurements.candidates import MANY, Candidates, candidates, ordered
from freelearn.queries.next_measurements.continuous_plan import Continuous, continuous
from freelearn.queries.next_measurements.exact_plan import choose
from freelearn.queries.next_measurements.goals import Discriminate, Goal, Narrow
from freelearn.queries.next_measurements.known_rows import Known
from freelearn.queries.next_measurements.recordings import FEWEST, Recordings, in_order, recordings, usual_rows
from freelearn.queries.next_measurements.views import Objective

There = TypeVar("There", Candidates, Recordings)


@dataclass(frozen=True)
class Choice:
    """table: the rows, chosen or the user's own. goal: without what no such plan tells. reach: rows of all candidates.
    objective: of these. ideal: the best shares of as many. unit: rows that are counted as one in both. notes:
    sentences."""

    table: pd.DataFrame
    goal: Goal
    reach: pd.DataFrame
    objective: Objective
    ideal: Continuous
    unit: int
    notes: list[str]


def chosen(known: Known, goal: Goal, settings: PlanSettings, own: pd.DataFrame | None) -> Choice:
    """Rows for a goal, or those of a plan of the user's own beside the best. Raises UserError."""
    return (_recordings if is_log(known.table) else _rows)(known, goal, settings, own)


def mountings_of(table: pd.DataFrame) -> np.ndarray:
    """Rows of each mounting, or recording, of a table."""
    return np.asarray(np.unique(kinematic_state(table), return_counts=True)[1])


def _rows(known: Known, goal: Goal, settings: PlanSettings, own: pd.DataFrame | None) -> Choice:
    if (settings.rows or 0) > MOST_ROWS:
        raise UserError(f"rows = {settings.rows} is too many: choose at most {MOST_ROWS}.")
    sizes = mountings_of(own) if own is not None else np.array([min(settings.per_state or 0, MANY)])

    def look(goal: Goal) -> Candidates:
        there = candidates(known, goal, settings.reach, settings.per_state, int(sizes.max()))
        if settings.per_state and 0 < (largest := there.objective.visits.largest) < settings.per_state:
            raise UserError(f"per_state = {settings.per_state} is too many: choose at most {largest}.")
        return there

    goal, there = _seen(look, goal)
    rows = settings.rows or int(sizes.sum())
    mountings = rows if own is None else len(sizes)
    goal, objective, twins = _without_twins(goal, there.objective, rows, mountings, f"{rows} rows")
    if own is not None:
        return Choice(own, goal, there.table, objective, continuous(objective, rows, mountings), 1, twins)
    best = choose(objective, rows, settings.per_state, settings.mounting_rows, settings.seed)
    table = ordered(there, best.visits, known.table, settings.seed)
    return Choice(table, goal, there.table, objective, best.ideal, 1, twins)


def _recordings(known: Known, goal: Goal, settings: PlanSettings, own: pd.DataFrame | None) -> Choice:
    if own is None:
        rows = settings.rows or 0
        count = min(settings.per_state or usual_rows(known.table), rows)
        number = round(rows / max(count, 1))
    else:
        count, number = usual_rows(own), len(mountings_of(own))
    if count < FEWEST:
        raise UserError(f"A recording has {FEWEST} rows at least: {count} are too few.")
    goal, there = _seen(lambda goal: recordings(known, goal, count, settings.reach), goal)
    many = f"{number} recording{'s' if number > 1 else ''}"
    goal, objective, twins = _without_twins(goal, there.objective, number, number, many)
    if own is not None:
        return Choice(own, goal, there.table, objective, continuous(objective, number, number), count, twins)
    best = choose(objective, number, 1, 0.0, settings.seed)
    table = in_order(there, best.visits, known.table, settings.seed)
    return Choice(table, goal, there.table, objective, best.ideal, count, twins)


def _seen(look: Callable[[Goal], There], goal: Goal) -> tuple[Goal, There]:
    """The goal without what no reading within reach depends on, and the candidates. Raises UserError where that is
    all."""
    there = look(goal)
    if not isinstance(goal, Narrow):
        return goal, there
    (view,) = there.objective.views
    seen = np.abs(view.columns).max((0, 1, 2))[-view.interest :]
    blind = [label for label, size in zip(goal.labels, seen, strict=True) if size == 0]
    if len(blind) == len(goal.labels):
        raise UserError(f"No reading within the bed's reach depends on {goal.names[0][0]}: there is nothing to plan.")
    if not blind:
        return goal, there
    goal = goal.without(blind)
    return goal, look(goal)


def _without_twins(
    goal: Goal, objective: Objective, rows: int, mountings: int, many: str
) -> tuple[Goal, Objective, list[str]]:
    """The goal without pairs that no such plan would tell, where others are left, and a sentence for each of them."""
    if not isinstance(goal, Discriminate):
        return goal, objective, []
    if float(continuous(objective, rows, mountings).bound) >= TELLING**2:
        return goal, objective, []
    views, twins, notes = [], [], []
    for view in objective.views:
        best = continuous(Objective(objective.visits, [view]), rows, mountings).bound ** 0.5
        if best >= TELLING:
            views.append(view)
            continue
        twins.append(view.name)
        notes.append(f"no {many} within the bed's reach would tell {' from '.join(view.name)} (by {best:.1f} σ)")
    if not views:
        return goal, objective, notes
    return goal.without(twins), Objective(objective.visits, views), notes
