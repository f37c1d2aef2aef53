"""From settings to a plan and its files, the library's or a user's own."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.api.settings.run_settings import PlanSettings
from freelearn.api.tasks.plan_source import Source, goal_of, present_value, source_of
from freelearn.common.cores import configure_runtime
from freelearn.common.csv_text import csv_text
from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.common.formats import all_finite
from freelearn.data.beds import BED
from freelearn.data.columns import Columns
from freelearn.data.states import kinematic_state
from freelearn.data.table.faults import Fault, TableError
from freelearn.data.table.questions import faults_of_given
from freelearn.data.table.records import columns_of, numbers_of, read_records
from freelearn.discovery.search.next_states import TELLING
from freelearn.queries.next_measurements.candidates import MANY, Candidates, candidates, ordered
from freelearn.queries.next_measurements.continuous_plan import Continuous, continuous
from freelearn.queries.next_measurements.exact_plan import choose, rows_for
from freelearn.queries.next_measurements.goals import NARROW, SURE, Discriminate, Goal, Narrow, Score, score
from freelearn.queries.next_measurements.views import Objective
from freelearn.records.estimates import searched_estimates, searched_quantile
from freelearn.records.plan_record import Certificate, Expected, Narrowed, Plan, plan_table
from freelearn.records.run_files import begin_results

# What else of a row counts, where the file says it.
NEEDED = ("sample", "step")
# How far a row may lie outside what the bed went to, as a share of that.
OUTSIDE = 1e-6


def read_plan(path: Path, measured: pd.DataFrame) -> pd.DataFrame:
    """The rows of a plan in the columns of a measured table: where to measure is the file's, what the sample is the
    table's. Raises UserError."""
    records = read_records(path)
    header = [name.strip() for name in records.header]
    wanted = [*NEEDED, *Columns.from_table(measured).imposed]
    if lacking := [name for name in wanted if name not in header]:
        raise UserError(f"{path} lacks the columns {', '.join(lacking)}: a plan says where to measure.")
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header.")
    cells, lines, faults = columns_of(records, header)
    if not faults:
        numbers = pd.DataFrame(
            {name: numbers_of(cells[name]) for name in wanted}, index=pd.Index(lines, dtype=np.int64)
        )
        for name in wanted:
            for i in np.flatnonzero(numbers[name].isna()).tolist():
                faults.append(Fault(lines[i], name, cells[name][i], "is no number: say where to measure"))
        faults = faults or faults_of_given(numbers, cells, records.header_line, wanted)
    if faults:
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))
    return _completed(path, numbers.reset_index(drop=True), measured)


def _completed(path: Path, numbers: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    known = measured.drop_duplicates("sample").set_index("sample")
    unknown = sorted(set(numbers["sample"]) - set(known.index))
    if unknown:
        there = ", ".join(str(n) for n in known.index)
        raise UserError(f"{path} plans sample {unknown[0]:g}, which the run has not: it has {there}.")
    rows = known.loc[numbers["sample"]].reset_index()
    for name in numbers:
        rows[name] = numbers[name].to_numpy()
    columns = Columns.from_table(measured)
    if columns.members:
        rows["pressure_kpa"] = rows[list(columns.pressures)].mean(axis=1)
    rows = rows.drop(columns=[name for name in ("time_s",) if name in rows])
    return rows.astype({"sample": np.int64, "step": np.int64})[[c for c in measured if c in rows or c == BED]]


def outside_reach(rows: pd.DataFrame, candidates: pd.DataFrame) -> list[str]:
    """A sentence for every column in which a plan goes beyond what the bed went to."""
    notes = []
    for name in Columns.from_table(rows).imposed:
        low, high = float(candidates[name].min()), float(candidates[name].max())
        room = OUTSIDE * max(high - low, abs(high), abs(low))
        count = int(((rows[name] < low - room) | (rows[name] > high + room)).sum())
        if count:
            where = f"{low:g} … {high:g}, where the bed went"
            notes.append(f"{count} of {len(rows)} rows lie outside the reach: {name} is not within {where}")
    return notes


# From settings to a plan and its files.


def planned(settings: PlanSettings) -> Plan:
    """The plan, or the user's own one scored. Raises UserError."""
    configure_runtime()
    began = time.perf_counter()
    source = source_of(settings.run)
    known, notes = source.known, list(source.notes)
    own = read_plan(settings.plan.path, known.table) if settings.plan.path is not None else None
    sizes = _rows_of_states(own) if own is not None else np.array([min(settings.per_state or 0, MANY)])
    goal, there = _told(source, goal_of(settings, source), settings, int(sizes.max()))
    rows = settings.rows or int(sizes.sum())
    mountings = rows if own is None else len(sizes)
    goal, there, twins = _without_twins(goal, there, rows, mountings)
    if own is not None:
        notes += outside_reach(own, there.table)
        table, ideal = own, continuous(there.objective, rows, mountings)
    else:
        chosen = choose(there.objective, rows, settings.per_state, settings.mounting_rows, settings.seed)
        table, ideal = ordered(there, chosen.visits, known.table, settings.seed), chosen.ideal
    scored = score(known, goal, table)
    if lost := int((~scored.answered).sum()):
        notes.append(f"{lost} of {len(table)} rows have no answer from the models: they tell nothing")
    about = _about(settings, source) | {"seconds": time.perf_counter() - began}
    return _result(goal, table, scored, there.objective, ideal, source, [*notes, *twins], about)


def _rows_of_states(table: pd.DataFrame) -> np.ndarray:
    return np.asarray(np.unique(kinematic_state(table), return_counts=True)[1])


def _told(source: Source, goal: Goal, settings: PlanSettings, levels: int) -> tuple[Goal, Candidates]:
    """The goal without what no reading within reach depends on, and the candidates. Raises UserError where that is
    all."""
    there = candidates(source.known, goal, settings.reach, settings.per_state, levels)
    largest = there.objective.visits.largest
    if settings.per_state and 0 < largest < settings.per_state:
        raise UserError(f"per_state = {settings.per_state} is too many: choose at most {largest}.")
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
    return goal, candidates(source.known, goal, settings.reach, settings.per_state, levels)


def _without_twins(goal: Goal, there: Candidates, rows: int, mountings: int) -> tuple[Goal, Candidates, list[str]]:
    """The goal without pairs that no such plan would tell, where others are left, and a sentence for each of them."""
    if not isinstance(goal, Discriminate):
        return goal, there, []
    objective = there.objective
    if float(continuous(objective, rows, mountings).bound) >= TELLING**2:
        return goal, there, []
    views, twins, notes = [], [], []
    for view in objective.views:
        best = continuous(Objective(objective.visits, [view]), rows, mountings).bound ** 0.5
        if best >= TELLING:
            views.append(view)
            continue
        twins.append(view.name)
        notes.append(f"no {rows} rows within the bed's reach would tell {' from '.join(view.name)} (by {best:.1f} σ)")
    if not views:
        return goal, there, notes
    return goal.without(twins), Candidates(there.table, Objective(objective.visits, views)), notes


def _result(
    goal: Goal,
    table: pd.DataFrame,
    scored: Score,
    objective: Objective,
    ideal: Continuous,
    source: Source,
    notes: list[str],
    about: dict[str, Any],
) -> Plan:
    weakest = scored.weakest
    prior = weakest.prior
    wanted = 4 * prior if goal.kind == NARROW else SURE**2
    certificate = Certificate(weakest.gain, ideal.bound - prior)
    mountings = len(_rows_of_states(table))
    return Plan(
        goal.kind,
        plan_table(table, weakest.shares.tolist()),
        source.known.table,
        tuple(Expected(one.name, one.before, one.after) for one in scored.gains),
        _narrowed(goal, scored, source.known.table) if isinstance(goal, Narrow) else (),
        certificate,
        mountings,
        rows_for(objective, len(table), mountings, wanted),
        tuple(notes),
        about,
    )


def _narrowed(goal: Narrow, scored: Score, measured: pd.DataFrame) -> tuple[Narrowed, ...]:
    """Standard errors of the goal's parameters, by what is measured and with the plan."""
    assert goal.fit is not None
    wide = searched_quantile(goal.fit.model, len(_rows_of_states(measured)))
    values = present_value(goal)
    (gain,) = scored.gains
    out = []
    for i, (label, value) in enumerate(zip(goal.labels, values, strict=True)):
        declared = goal.fit.model.declared[label]
        unit = goal.sizes[i] * (value if declared.log else 1.0)
        before, after = (unit * error[i] for error in (gain.errors_before, gain.errors_after))
        told, error, reach = ({label: float(number)} for number in (value, before, wide * before))
        (known,) = searched_estimates(told, error, reach, goal.fit.model)
        out.append(Narrowed(label, declared.unit, float(value), float(before), float(after), known.untold))
    return tuple(out)


def _about(settings: PlanSettings, source: Source) -> dict[str, Any]:
    return {
        "run": str(settings.run),
        "kind": source.kind,
        "model": source.model.name,
        "effects": source.effects,
        "own_plan": None if settings.plan.path is None else str(settings.plan.path),
        "per_state": settings.per_state,
        "mounting_rows": settings.mounting_rows,
        "reach": {name: list(ends) for name, ends in settings.reach.items()},
        "seed": settings.seed,
        "rows_known": len(source.known.table),
        "data": source.provenance.plain(),
    }


def write_plan(made: Plan, folder: Path, figures: bool) -> None:
    """plan.csv, the picture, and plan.json last. Raises UserError where the folder cannot be written to."""
    begin_results(folder, "plan.json")
    write_text(folder / "plan.csv", csv_text(made.table))
    if figures:
        # matplotlib costs a second to import: only when there is something to draw.
        from freelearn.report.plots.plan_plot import draw_plan

        draw_plan(made, folder / "plan_places.png")
    content = all_finite(made.content())
    write_text(folder / "plan.json", json.dumps(content, indent=2, allow_nan=False) + "\n")
