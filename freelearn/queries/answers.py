"""What a fitted model answers to a table with blanks: the columns of answers.csv."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from torch import Tensor

from freelearn.common.csv_text import csv_text
from freelearn.common.files import write_text
from freelearn.data.beds import ELONGATION
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.asker import Answered
from freelearn.queries.inverse.compromise import UNANSWERED
from freelearn.queries.inverse.system import System
from freelearn.records.run_files import begin_results

ANSWERS_FILE, SOLUTIONS_FILE = "answers.csv", "solutions.csv"
# What an answer is extended by, besides its bands.
SOLUTIONS, STATUS, EXTRAPOLATED, NOTE = "solutions", "status", "extrapolated", "note"
OTHER_DESIGN = "an actuator that the model was not fitted on"
BEYOND = "beyond what was measured"


@dataclass(frozen=True, repr=False)
class Answers:
    """Answers to a table of questions.

    filled: the questions with every blank that has an answer filled, in engineering units; each filled column is
    followed by NAME_low and NAME_high, 95 % for a new measurement (blank where it was given, and without bands). Then
    solutions, status, extrapolated (0 or 1) and note. every: all solutions of rows with several: row (from 0), what was
    asked for, stable (0 or 1) and status. asked: the columns that were filled.
    """

    filled: pd.DataFrame
    every: pd.DataFrame
    asked: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.filled)

    def __getitem__(self, names: Any) -> Any:
        """A column of `frame`, or several."""
        return self.filled[names]

    def table(self) -> pd.DataFrame:
        """answers.csv."""
        return self.filled

    def frame(self) -> pd.DataFrame:
        """The questions with their answers."""
        return self.filled.copy()

    def save(self, folder: str | Path) -> Path:
        """Writes answers.csv and, where rows have several solutions, solutions.csv, as the command does. Raises
        UserError."""
        place = Path(folder)
        # Of earlier questions in the same folder.
        for name in (ANSWERS_FILE, SOLUTIONS_FILE):
            begin_results(place, name)
        if len(self.every):
            write_text(place / SOLUTIONS_FILE, csv_text(self.every, "%.10g"))
        write_text(place / ANSWERS_FILE, csv_text(self.table(), "%.10g"))
        return place

    def __repr__(self) -> str:
        return repr(self.filled)

    def _repr_html_(self) -> str:
        return str(self.filled.to_html(max_rows=20, border=0, float_format="{:.5g}".format))

    def counts(self) -> dict[str, int]:
        """Rows by status, the commonest first."""
        return {str(name): int(count) for name, count in self.filled[STATUS].value_counts().items()}


@dataclass(frozen=True)
class Column:
    """A quantity's column, its values as answered and half its band, (N,) each, in its unit."""

    name: str
    value: np.ndarray
    half: np.ndarray


def columns_of(system: System, answered: Answered) -> list[Column]:
    """Every input and output in engineering units."""
    reference = system.states.reference_length.numpy()
    values = _in_units(system, answered.x, answered.y, reference)
    halves = _in_units(system, answered.x_half, answered.y_half, 0 * reference)
    return [Column(name, value, halves[name]) for name, value in values.items()]


def _in_units(system: System, x: Tensor, y: Tensor, reference: np.ndarray) -> dict[str, np.ndarray]:
    """Inputs (n, m) and outputs (n, 2), SI, in engineering units by their columns. reference: what is taken off an
    input that is a length, (n,) m, for there it is the whole of it."""
    quantities, columns = (*system.inputs, *system.bed.readings), {}
    values = np.c_[x.numpy(), y.numpy()].T
    for i, (name, quantity, value) in enumerate(zip(system.columns, quantities, values, strict=True)):
        rest = reference if quantity is ELONGATION and i < len(system.inputs) else 0.0
        columns[name] = (value - rest) / quantity.factor
    return columns


def answers(
    questions: pd.DataFrame, system: System, answered: Answered, known: np.ndarray, diameter: Column | None = None
) -> Answers:
    """The filled table. known: rows of actuators that the model was fitted on, (N,) bool. diameter: where it is asked
    for."""
    columns = [*columns_of(system, answered), *([diameter] if diameter else [])]
    filled, asked = questions.copy(), []
    lost = np.array([status == UNANSWERED for status in answered.status], dtype=bool)
    for column in columns:
        given = _given(questions, column.name)
        fill = ~given & ~lost
        if column.name not in questions and not fill.any():
            continue
        if given.all():
            continue
        value = np.where(given, questions.get(column.name, pd.Series(np.nan, questions.index)), column.value)
        value = np.where(lost & ~given, np.nan, value)
        half = np.where(fill, column.half, np.nan)
        filled[column.name] = value
        bands = {f"{column.name}_low": value - half, f"{column.name}_high": value + half}
        filled = _beside(filled, column.name, bands)
        asked.append(column.name)
    notes = _notes(answered, known)
    outside = answered.extrapolated.numpy() | ~known
    more = {
        SOLUTIONS: answered.solutions.numpy(),
        STATUS: answered.status,
        EXTRAPOLATED: np.where(lost, 0, outside).astype(np.int64),
        NOTE: notes,
    }
    filled = filled.drop(columns=[name for name in more if name in filled])
    return Answers(filled.assign(**more), _every(system, answered), tuple(asked))


def _given(questions: pd.DataFrame, name: str) -> np.ndarray:
    if name not in questions:
        return np.zeros(len(questions), dtype=bool)
    there: np.ndarray = questions[name].notna().to_numpy()
    return there


def _beside(table: pd.DataFrame, name: str, more: dict[str, np.ndarray]) -> pd.DataFrame:
    """The table with columns behind one of its own."""
    table = table.drop(columns=[n for n in more if n in table])
    place = list(table.columns).index(name) + 1
    new = pd.DataFrame(more, index=table.index)
    return pd.concat([table.iloc[:, :place], new, table.iloc[:, place:]], axis=1)


def _notes(answered: Answered, known: np.ndarray) -> list[str]:
    notes = []
    for i, why in enumerate(answered.why):
        words = [why] if why else []
        if answered.status[i] != UNANSWERED:
            words += [] if known[i] else [OTHER_DESIGN]
            words += [BEYOND] if known[i] and answered.extrapolated[i] else []
        notes.append("; ".join(words))
    return notes


def _every(system: System, answered: Answered) -> pd.DataFrame:
    """All solutions of rows with several, one a row."""
    every = answered.every
    row = every.row.numpy()
    columns = _in_units(system, every.x, every.outputs, system.states.reference_length.numpy()[row])
    words = np.array([s.name.lower() for s in Status])[every.status.numpy()] if len(row) else []
    table = pd.DataFrame({"row": row, **columns, "stable": every.stable.numpy().astype(np.int64), STATUS: words})
    return table.sort_values("row", kind="stable").reset_index(drop=True)
