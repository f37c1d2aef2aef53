"""What terminal and page say of answers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.formats import number
from freelearn.data.beds import DIAMETER, ELONGATION, FORCE, MOMENT, PRESSURE, TWIST
from freelearn.data.columns import members_in, pressure_column
from freelearn.queries.answers import EXTRAPOLATED, NOTE, SOLUTIONS, STATUS, Answers
from freelearn.queries.fitted_model import FittedModel

ROWS = 12
# As columns spell units, and as they are written.
UNITS = {"deg": "°", "kpa": "kPa", "n": "N", "nmm": "N·mm"}
MEANING = {
    "no_equilibrium": "no inner radius carries the pressure: the tube balloons",
    "singular": "the linear model divides by zero: fibers along the axis",
    "overstretched": "longer than an inextensible fiber allows",
    "unstable": "a solution that would not stay: under these loads the actuator leaves it",
    "unreachable": "nothing within the span looked through meets what was given: the nearest is told",
    "unanswered": "the question leaves too much open: its note says what to give",
}


def answers_table(answers: Answers) -> DisplayTable:
    """The first rows: what was asked with its band, and the status."""
    table = answers.table()
    names = [name for name in _imposed(table) if name in table]
    heads = [_head(name) for name in names]
    cells = []
    for _, row in table.head(ROWS).iterrows():
        cells.append([*(_cell(row, name) for name in names), str(row[STATUS])])
    shown = f"{ROWS} of {len(table)} answers" if len(table) > ROWS else "answers"
    return DisplayTable.from_rows([], heads, cells, shown, "± half of the 95 % band", last=["status"])


def _imposed(table: pd.DataFrame) -> list[str]:
    members = [pressure_column(m) for m in members_in(table.columns)]
    return [
        ELONGATION.column, TWIST.column, *(members or [PRESSURE.column]), FORCE.column, MOMENT.column, DIAMETER.column,
    ]  # fmt: skip


def _head(name: str) -> str:
    *words, unit = name.split("_")
    return f"{' '.join(words)} {UNITS.get(unit, unit)}"


def _cell(row: Any, name: str) -> str:
    value = float(row[name])
    if not math.isfinite(value):
        return "–"
    low = float(row.get(f"{name}_low", np.nan))
    if not math.isfinite(low):
        return number(value, 4)
    return f"{number(value, 4)} ± {number(value - low, 2)}"


def answer_lines(answers: Answers, fitted: FittedModel) -> list[str]:
    """Sentences on all answers: how many are no good, and why; extrapolated ones; bands."""
    table, sentences = answers.table(), []
    counts = answers.counts()
    good = counts.pop("ok", 0)
    sentences.append(f"{good} of {len(table)} rows answered")
    sentences += [f"{count} {status}: {MEANING[status]}" for status, count in counts.items()]
    several = int((table[SOLUTIONS] > 1).sum())
    if several:
        sentences.append(
            f"{several} with several solutions: the stable one that is reached from rest is told, or that of the least "
            "pressure; solutions.csv has all"
        )
    beyond = int(table[EXTRAPOLATED].sum())
    if beyond:
        sentences.append(f"{beyond} extrapolated beyond what the model was fitted on: their bands may be too narrow")
    directed = [effect.name for effect in fitted.model.effects if effect.directed]
    if directed and good and "run" not in table and any(name.startswith("pressure") for name in answers.asked):
        sentences.append(
            f"{', '.join(directed)} goes by whether the pressure rises or falls, which is not known before it is "
            "answered: each pressure is told midway between the two"
        )
    words = table.loc[table[STATUS] == "unanswered", NOTE]
    sentences += [f"row {i + 1}: {text}" for i, text in words.head(5).items()]
    banded = [f"{name}_low" for name in answers.asked]
    if banded and table[banded].isna().all(axis=None) and good:
        sentences.append("no bands: " + _why_none(fitted))
    return sentences


def _why_none(fitted: FittedModel) -> str:
    if fitted.bands is None:
        return "the run has no row that tells how far the model misses"
    return "nothing was measured that tells how far the model misses of these"
