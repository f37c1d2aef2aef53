"""Readings that slipped, perhaps, as the user knows them: by their line in the table, in its units; and their files."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.csv_text import csv_text
from freelearn.common.files import write_bytes, write_text
from freelearn.common.formats import finite, fixed
from freelearn.data.beds import DEAD_LOAD, ELONGATION, TWIST, Quantity, bed_of, behind
from freelearn.data.columns import LEFT_OUT
from freelearn.data.table.records import mark_left_out
from freelearn.discovery.residuals.suspects import Suspect
from freelearn.records.provenance import Provenance

# What only a dead load imposes.
HUNG = tuple(quantity.column for quantity in DEAD_LOAD.state)


@dataclass(frozen=True)
class SuspectedReading:
    """A reading of which the search thinks that it slipped.

    line: of its row in the table's file. load: force, moment, or what else the bed measures; shown, expected: in
    `unit`. sigmas: signed. slip: how it probably slipped, in words, "" where nothing fits. lines: of all rows that
    slipped together. elongation_mm, twist_deg: None where blank. force_n, moment_nmm: imposed, under a dead load only.
    """

    line: int
    sample: int
    step: int
    elongation_mm: float | None
    twist_deg: float | None
    pressure_kpa: float
    load: str
    shown: float
    expected: float
    unit: str
    sigmas: float
    slip: str
    lines: tuple[int, ...]
    force_n: float | None = None
    moment_nmm: float | None = None

    def plain(self) -> dict[str, Any]:
        """The entry in discovery.json."""
        known = {name: value for name, value in vars(self).items() if name not in HUNG or value is not None}
        return known | {"lines": list(self.lines)}

    @classmethod
    def from_plain(cls, entry: Mapping[str, Any]) -> SuspectedReading:
        """The reading that `plain` wrote."""
        return cls(**{**entry, "lines": tuple(entry["lines"])})

    @property
    def readings(self) -> tuple[str, str]:
        """What the row shows and what was expected, in its unit, with so many digits that the difference can be
        seen."""
        apart = abs(self.shown - self.expected)
        digits = min(max(2 - math.floor(math.log10(apart)), 0), 6) if 0 < apart < math.inf else 3
        unit = behind(self.unit)
        return f"{with_sign(self.shown, digits)}{unit}", f"{with_sign(self.expected, digits)}{unit}"

    @property
    def deviation(self) -> str:
        """By how many standard deviations it is off, without the unit."""
        return with_sign(self.sigmas, 1 if abs(self.sigmas) < 10 else 0)

    def sentence(self) -> str:
        """What a researcher would say about it."""
        shown, expected = self.readings
        together = len(self.lines) > 1
        where = f"lines {ranges(self.lines)}" if together else f"line {self.line}"
        here = f" in line {self.line}" if together else ""
        text = f"{where}: the {self.load} shows {shown} where {expected} was expected{here} ({self.deviation} σ)"
        return f"{text}: {self.slip}" if self.slip else text


def suspected_readings(suspects: Sequence[Suspect], table: pd.DataFrame, lines: np.ndarray) -> list[SuspectedReading]:
    """The suspects, those that are off by the most σ first.

    table: the rows that were asked about, in the measurement table's columns; lines: theirs in its file, (N,).
    """
    bed = bed_of(table)
    readings = []
    for suspect in suspects:
        row = table.iloc[suspect.row]
        quantity = next(q for q in (*bed.readings, *bed.state) if q.name == suspect.load)
        place = {q.column: finite(row[q.column]) if q.column in row else None for q in (ELONGATION, TWIST)}
        place |= {name: float(row[name]) for name in HUNG if bed is DEAD_LOAD}
        slip = suspect.slip
        if suspect.source is not None:
            slip += f", perhaps line {lines[suspect.source]}'s"
        readings.append(
            SuspectedReading(
                line=int(lines[suspect.row]),
                sample=int(row["sample"]),
                step=int(row["step"]),
                pressure_kpa=float(row["pressure_kpa"]),
                load=suspect.load,
                shown=suspect.shown / quantity.factor,
                expected=suspect.expected / quantity.factor,
                unit=quantity.unit,
                sigmas=suspect.sigmas,
                slip=slip,
                lines=tuple(int(lines[at]) for at in sorted({suspect.row, *suspect.rows})),
                **place,
            )
        )
    return sorted(readings, key=lambda reading: -abs(reading.sigmas))


def suspects_frame(readings: Sequence[SuspectedReading]) -> pd.DataFrame:
    """The readings as a table, in the columns of their entries; the lines of a block stand in one cell, with blanks
    between them."""
    rows = [reading.plain() | {"lines": " ".join(map(str, reading.lines))} for reading in readings]
    columns = list(rows[0]) if rows else [n for n in SuspectedReading.__dataclass_fields__ if n not in HUNG]
    place = {q.column: np.float64 for q in (ELONGATION, TWIST)} if rows else {}
    return pd.DataFrame(rows, columns=columns).astype(place)


def suspected_lines(readings: Sequence[SuspectedReading]) -> list[int]:
    """Every line with a suspected reading, in order; not those of a block, whose readings can be put right."""
    return sorted({reading.line for reading in readings if len(reading.lines) == 1})


def worst_of_each(readings: Sequence[SuspectedReading]) -> list[SuspectedReading]:
    """The readings, but of those that slipped together only the one that is off by the most σ, which comes first."""
    worst: dict[tuple[Any, ...], SuspectedReading] = {}
    for reading in readings:
        worst.setdefault((reading.load, reading.lines), reading)
    return list(worst.values())


def flagged(table: pd.DataFrame, suspects: Sequence[Suspect]) -> pd.DataFrame:
    """The table with the suspects' rows left out, and marked in the columns suspect_force and suspect_moment, or of
    what else the bed measures (bool).

    table: the rows that were asked about, in the measurement table's columns. A block that slipped together is no
    reason to look at nothing else.
    """
    marks = {q.name: np.zeros(len(table), dtype=bool) for q in bed_of(table).measured}
    for suspect in suspects:
        if len(suspect.rows) == 1:
            marks[suspect.load][suspect.row] = True
    return with_marks(table, marks)


def with_marks(table: pd.DataFrame, marks: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """The table with its suspected readings marked and their rows left out. marks: of each quantity, (N,) bool."""
    either = np.any(list(marks.values()), axis=0)
    columns = {mark(q): marks[q.name] for q in bed_of(table).measured}
    return table.assign(**columns, **{LEFT_OUT: either.astype(np.int64)})


def mark(quantity: Quantity) -> str:
    """The column that marks a quantity's suspected readings."""
    return f"suspect_{quantity.name.replace(' ', '_')}"


def ranges(lines: Sequence[int], most: int = 4) -> str:
    """Lines in order, as few words as possible.

    >>> ranges((3, 4, 5, 9)), ranges(range(1, 100, 2))
    ('3–5, 9', '1 … 99 (50 rows)')
    """
    cuts = np.flatnonzero(np.diff(lines) != 1) + 1
    parts = [part.tolist() for part in np.split(np.asarray(lines), cuts)]
    if len(parts) > most:
        return f"{lines[0]} … {lines[-1]} ({len(lines)} rows)"
    return ", ".join(str(part[0]) if len(part) == 1 else f"{part[0]}–{part[-1]}" for part in parts)


def with_sign(value: float, digits: int) -> str:
    """A number with so many digits behind the point, which always shows its sign.

    >>> with_sign(3.14, 1), with_sign(-420.0, 0)
    ('+3.1', '−420')
    """
    return fixed(value, digits) if value < 0 else f"+{fixed(value, digits)}"


SUSPECTS, MARKED = "suspects.csv", "marked.csv"


def write_suspects(readings: Sequence[SuspectedReading], provenance: Provenance, folder: Path) -> None:
    """Writes suspects.csv and, where there are any in a user's file, marked.csv: that file with left_out = 1 there."""
    write_text(folder / SUSPECTS, csv_text(suspects_frame(readings)))
    marked = folder / MARKED
    if provenance.path and Path(provenance.path).resolve() == marked.resolve():
        return  # the user's own by now: what is searched is never written to
    content = _original(provenance) if readings else None
    if content is None:
        marked.unlink(missing_ok=True)
    else:
        write_bytes(marked, mark_left_out(content, suspected_lines(readings)))


def _original(provenance: Provenance) -> bytes | None:
    """The file that was searched; None where there is none, or another one by now: its lines would be others."""
    try:
        content = Path(provenance.path).read_bytes() if provenance.path else None
    except OSError:
        return None
    return content if content is not None and hashlib.sha256(content).hexdigest() == provenance.sha256 else None
