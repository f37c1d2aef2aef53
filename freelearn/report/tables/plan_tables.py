"""What terminal and picture show of a plan."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.formats import fixed, number, percent, sentence, signed
from freelearn.data.beds import BED
from freelearn.data.logs import is_log
from freelearn.data.states import kinematic_state
from freelearn.queries.curves.curve_rows import digits, pressures
from freelearn.queries.curves.shown_states import places
from freelearn.queries.next_measurements.courses import course_in_words
from freelearn.records.estimates import untold_sentence
from freelearn.records.plan_record import EXPECTED, Narrowed, Plan

# Mountings within this share of what the bed spans are one mark.
NEAR = 0.02


def mounting_table(plan: Plan, most: int | None = None) -> DisplayTable:
    """A line for each mounting or recording: where, at which pressures, and the σ it is expected to add. most: lines
    shown."""
    table = plan.table
    rows = []
    for part in visits(plan):
        at = [signed(float(part[q.column].iloc[0]), digits(q)) for q in plan.bed.state]
        each = [course_in_words(part)] if is_log(table) else [_read(part[q.column]) for q in pressures(table)]
        rows.append([str(int(part["sample"].iloc[0])), *at, fixed(expected_of(part), 1), *each])
    names = ["what to do"] if is_log(table) else [f"{q.symbol} kPa" for q in pressures(table)]
    left = len(rows) - (most or len(rows))
    caption = f"and {left} more, in plan.csv" if left > 0 else ""
    imposed = [f"{q.name} {q.unit}" for q in plan.bed.state]
    headings = [*imposed, "expected σ"]
    return DisplayTable.from_rows(["sample"], headings, rows[:most], "What to measure next", caption, last=names)


def _read(column: pd.Series) -> str:
    return ", ".join(number(float(p), 3) for p in column)


def visits(plan: Plan) -> list[pd.DataFrame]:
    """The rows of each mounting, or recording, in the order of measuring."""
    state = kinematic_state(plan.table.assign(**{BED: plan.bed.name}))
    return [plan.table[state == visit] for visit in dict.fromkeys(state.tolist())]


def expected_of(part: pd.DataFrame) -> float:
    """σ that some rows of a plan are expected to add."""
    return math.sqrt(float((part[EXPECTED] ** 2).sum()))


def expected_table(plan: Plan) -> DisplayTable:
    """What is told of each thing, before and after."""
    pairs = len(plan.expected[0].name) == 2
    words = ["if this is there", "it is told from"] if pairs else ["of"]
    rows = [[*e.name, fixed(e.before, 1), fixed(e.after, 1)] for e in plan.expected]
    return DisplayTable.from_rows(words, ["σ now", "σ then"], rows, "What is expected of it")


def parameter_rows(plan: Plan) -> DisplayTable:
    """The parameters that are narrowed."""
    rows = [
        [p.name, number(p.value, 2 if p.untold else 5), *_errors(p), fixed(p.factor, 2), p.unit]
        for p in plan.parameters
    ]
    headings = ["value", "± now", "± then", "factor"]
    return DisplayTable.from_rows(["parameter"], headings, rows, "How it narrows", last=["unit"])


def _errors(p: Narrowed) -> list[str]:
    """Standard errors before and after; of what the rows say nothing of they mean nothing."""
    return [number(None if p.untold else error, 3) for error in (p.before, p.after)]


def plan_lines(plan: Plan) -> list[str]:
    """The rest in sentences."""
    lines = [plan.says(), plan.certificate.sentence(plan.visit), needed_line(plan)]
    untold = [untold_sentence(p.name, p.value, p.before, p.unit) for p in plan.parameters if p.untold]
    return [*lines, *untold, *(sentence(note) for note in plan.notes)]


PURPOSES = {"discriminate": "To discriminate the class", "detect": "To detect it", "narrow": "To halve the interval"}


def needed_line(plan: Plan) -> str:
    """How many rows reach the goal."""
    what, unit = PURPOSES[plan.goal], "recording" if is_log(plan.table) else "row"
    if not math.isfinite(plan.rows_needed):
        return f"{what}, no number of {unit}s within the bed's reach will do."
    if plan.rows_needed <= 0:
        return f"{what}, no further {unit} is needed."
    if is_log(plan.table):
        many = math.ceil(plan.rows_needed * len(visits(plan)) / len(plan.table))
        return f"{what}, about {many} such recording{'s are' if many > 1 else ' is'} needed."
    return f"{what}, about {math.ceil(plan.rows_needed)} such rows are needed."


def efficiency_text(plan: Plan) -> str:
    """The share of the best that is possible, as a number."""
    return f"≥ {percent(plan.certificate.efficiency, 0)} %"


def place_table(plan: Plan) -> pd.DataFrame:
    """A row for each place: sample, what the bed imposes there, rows of the plan (0 where it was measured before), and
    the σ expected of them. Mountings that lie beside each other are one place."""
    imposed = [q.column for q in plan.bed.state]
    old = places(plan.measured).assign(rows=0, expected_z=0.0)
    table = plan.table.assign(rows=1, square=plan.table[EXPECTED] ** 2)
    near = {name: (table[name] / (NEAR * (_span(plan, name) or 1.0))).round() for name in imposed}
    taken = {**dict.fromkeys(imposed, "first"), "rows": "sum", "square": "sum"}
    new = table.groupby([table["sample"], *near.values()]).agg({"sample": "first", **taken}).reset_index(drop=True)
    new = new.assign(expected_z=new["square"] ** 0.5)
    return pd.concat([frame[["sample", *imposed, "rows", EXPECTED]] for frame in (old, new)], ignore_index=True)


def _span(plan: Plan, name: str) -> float:
    return float(np.ptp(np.concatenate([plan.measured[name], plan.table[name]])))
