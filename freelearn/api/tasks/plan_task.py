"""From settings to a plan and its files, the library's or a user's own."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.api.settings.run_settings import PlanSettings
from freelearn.api.tasks.own_plan import outside_reach, read_plan
from freelearn.api.tasks.plan_choice import Choice, chosen, mountings_of
from freelearn.api.tasks.plan_source import Source, goal_of, present_value, source_of
from freelearn.common.cores import configure_runtime
from freelearn.common.csv_text import csv_text
from freelearn.common.files import write_text
from freelearn.common.formats import all_finite
from freelearn.data.logs import RUN, is_log
from freelearn.queries.next_measurements.courses import course_in_words
from freelearn.queries.next_measurements.exact_plan import rows_for
from freelearn.queries.next_measurements.goals import NARROW, SURE, Narrow, Score, score
from freelearn.records.estimates import searched_estimates, searched_quantile
from freelearn.records.plan_record import Certificate, Expected, Narrowed, Plan, plan_table
from freelearn.records.run_files import begin_results


def planned(settings: PlanSettings) -> Plan:
    """The plan, or the user's own one scored. Raises UserError."""
    configure_runtime()
    began = time.perf_counter()
    source = source_of(settings.run)
    known = source.known
    own = read_plan(settings.plan.path, known.table) if settings.plan.path is not None else None
    choice = chosen(known, goal_of(settings, source), settings, own)
    scored = score(known, choice.goal, choice.table)
    notes = [*source.notes, *(outside_reach(own, choice.reach) if own is not None else [])]
    if lost := int((~scored.answered).sum()):
        notes.append(f"{lost} of {len(choice.table)} rows have no answer from the models: they tell nothing")
    about = _about(settings, source) | {"seconds": time.perf_counter() - began}
    if is_log(choice.table):
        about["recordings"] = _courses(choice.table)
    return _result(choice, scored, known.table, [*notes, *choice.notes], about)


def _courses(table: pd.DataFrame) -> list[dict[str, Any]]:
    """What to do in each recording of a log, as plan.json holds it."""
    runs = table.groupby(RUN, sort=False)
    return [{"run": str(run), "sample": int(rows["sample"].iloc[0]), "do": course_in_words(rows)} for run, rows in runs]


def _result(choice: Choice, scored: Score, measured: pd.DataFrame, notes: list[str], about: dict[str, Any]) -> Plan:
    weakest, goal, table = scored.weakest, choice.goal, choice.table
    wanted = 4 * weakest.prior if goal.kind == NARROW else SURE**2
    mountings = len(mountings_of(table))
    needed = choice.unit * rows_for(choice.objective, len(table) // choice.unit, mountings, wanted)
    if not needed and goal.kind != NARROW and weakest.before < SURE:
        # Of several parameters the criterion is about each of them, and they may be told where their sum is not.
        needed = len(table) * (SURE**2 - weakest.before**2) / max(weakest.after**2 - weakest.before**2, 1e-300)
    return Plan(
        goal.kind,
        plan_table(table, weakest.shares.tolist()),
        measured,
        tuple(Expected(one.name, one.before, one.after) for one in scored.gains),
        _narrowed(goal, scored, measured) if isinstance(goal, Narrow) else (),
        Certificate(weakest.gain, choice.ideal.bound - weakest.prior),
        mountings,
        needed,
        tuple(notes),
        about,
    )


def _narrowed(goal: Narrow, scored: Score, measured: pd.DataFrame) -> tuple[Narrowed, ...]:
    """Standard errors of the goal's parameters, by what is measured and with the plan."""
    assert goal.fit is not None
    wide = searched_quantile(goal.fit.model, len(mountings_of(measured)))
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
