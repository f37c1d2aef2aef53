"""Reading a measurement table (CSV), with every fault of the file in one report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.common.progress import tell
from freelearn.data.beds import BED, KINEMATIC, Bed
from freelearn.data.columns import (
    INTEGERS,
    LEFT_OUT,
    OPTIONAL,
    RISEN,
    SLACK,
    Columns,
    members_in,
    pressure_columns,
    shown_readings,
    usable_rows,
    used_rows,
    with_members,
)
from freelearn.data.table.faults import TableError
from freelearn.data.table.log_tables import log_faults, thinned
from freelearn.data.table.plain_table import read_plain
from freelearn.data.table.records import (
    Records,
    columns_of,
    nearly_named,
    numbers_of,
    read_records,
    refuse_other_formats,
)
from freelearn.data.table.row_suspicions import row_suspicions
from freelearn.data.table.schema import faultless, find_faults
from freelearn.data.table.unit_suspicions import unit_warnings

BLANK_MARKS = (LEFT_OUT, SLACK, RISEN)


@dataclass(frozen=True)
class TableFile:
    """A checked measurement table.

    table: the file's columns and N rows in their order: sample, step, buckled and left_out (blank: 0) as int64, the
    contract's other columns as float64 in the units that their names say, further columns as the text in the file.
    lines: the line in the file at which each row begins, (N,) int64. warnings: about columns that are not used or not
    there, about units that look wrong (UnitWarning), and about rows that do.
    """

    table: pd.DataFrame
    lines: np.ndarray
    warnings: list[str]


def read_table(
    path: str | Path, bed: Bed = KINEMATIC, members: pd.DataFrame | None = None, rate_hz: float | None = None
) -> TableFile:
    """Reads and checks a measurement table. Blank lines are skipped.

    bed: what was imposed and what was measured. members: of one end block, see `read_members`. rate_hz: to which a log
    is thinned, see `thinned`; lines are then those of the rows nearest to the new ones.

    Raises TableError with all faults of the rows and columns, and UserError where the file as a whole is not such a
    table. Nothing is executed or written.
    """
    columns = Columns(bed, 0 if members is None else len(members))
    read = _plain(path, bed, columns) or _careful(path, bed, columns)
    header, frame = read.header, read.frame
    if not usable_rows(frame).any():
        marked = "buckled" if frame["buckled"].all() else "buckled or left out"
        raise UserError(f"Every row of {path} is marked as {marked}, so none can be fitted or scored.")
    if bed is not KINEMATIC or BED in frame:
        frame[BED] = bed.name
    if members is not None:
        frame = with_members(frame, members)
    _refuse_nothing_read(path, frame)
    lines = read.lines
    if wrong := log_faults(frame, lines, rate_hz is not None):
        raise TableError(path, wrong)
    near = nearly_named(header, (*columns.blank, *OPTIONAL), columns.known)
    warnings = [*near, *_unmeasured(header, columns)]
    if rate_hz is not None:
        frame, place, done = thinned(frame, rate_hz)
        lines, warnings = lines[place], [*warnings, *done]
    return TableFile(frame, lines, [*warnings, *unit_warnings(frame), *row_suspicions(frame, lines)])


@dataclass(frozen=True)
class _Read:
    """header: as in the file. frame: its columns, as of TableFile, in their order. lines: of the rows."""

    header: list[str]
    frame: pd.DataFrame
    lines: np.ndarray


def _plain(path: str | Path, bed: Bed, columns: Columns) -> _Read | None:
    """A large file without anything odd; None where the careful reader has to look at it."""
    plain = read_plain(path, columns.known, columns.required)
    if (
        plain is None
        or (not columns.members and members_in(plain.header))
        or (BED in plain.text and {cell.strip() for cell in set(plain.text[BED])} != {bed.name})
    ):
        return None
    for name in (name for name in BLANK_MARKS if name in plain.numbers):
        np.nan_to_num(plain.numbers[name], copy=False)
    tell("checking", 0, 1)
    if not faultless(pd.DataFrame(plain.numbers, copy=False), plain.header, columns):
        return None
    for name in (name for name in INTEGERS if name in plain.numbers):
        plain.numbers[name] = plain.numbers[name].astype(np.int64)
    cells = {name: plain.numbers[name] if name in plain.numbers else plain.text[name] for name in plain.header}
    lines = np.arange(2, 2 + len(plain), dtype=np.int64)
    return _Read(plain.header, pd.DataFrame(cells, copy=False), lines)


def _careful(path: str | Path, bed: Bed, columns: Columns) -> _Read:
    """Any file, with every fault in one report."""
    records = read_records(path)
    header = [name.strip() for name in records.header]
    refuse_other_formats(path, header, columns.required, columns.listed)
    _refuse_other_bed(path, header, records, bed)
    _refuse_unknown_members(path, header, columns)
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header. Add the measurements below it.")

    text, lines, faults = columns_of(records, header)
    known = [name for name in columns.known if name in text]
    columns_read = {name: numbers_of(_unmarked(text[name]) if name in BLANK_MARKS else text[name]) for name in known}
    numbers = pd.DataFrame(columns_read, index=pd.Index(lines, dtype=np.int64))
    faults += find_faults(numbers, text, records.header_line, columns)
    if faults:
        foreign = 2 * sum(name in text for name in columns.required) < len(columns.required)
        raise TableError(path, sorted(faults, key=lambda fault: fault.line), foreign)

    numbers = numbers.astype({name: np.int64 for name in INTEGERS if name in numbers}).reset_index(drop=True)
    frame = pd.DataFrame({name: numbers[name] if name in numbers else list(text[name]) for name in header})
    return _Read(header, frame, np.array(lines, dtype=np.int64))


def _unmarked(cells: Sequence[str]) -> list[str]:
    """The cells of a column of marks; one that is blank marks nothing."""
    return [cell if cell.strip() else "0" for cell in cells]


def _refuse_nothing_read(path: str | Path, frame: pd.DataFrame) -> None:
    _, present, _ = shown_readings(used_rows(frame))
    if not present.any():
        raise UserError(f"{path} has no reading in any row that may be fitted: fill in what was measured.")


def _refuse_other_bed(path: str | Path, header: list[str], records: Records, bed: Bed) -> None:
    """A table that tells its bed, as predictions.csv does, was measured on no other."""
    if BED not in header:
        return
    told = {row[header.index(BED)].strip() for row in records.rows if len(row) == len(header)}
    if told - {bed.name}:
        other = sorted(told - {bed.name})[0]
        raise UserError(
            f"{path} says that its bed is {other!r}, not {bed.name!r}: add data.bed={other}, or correct it."
        )


def _refuse_unknown_members(path: str | Path, header: list[str], columns: Columns) -> None:
    """Pressures of several actuators, of which nobody says what they are."""
    if columns.members or not (several := members_in(header)):
        return
    names = ", ".join(pressure_columns(several))
    raise UserError(
        f"{path} has {names}: pressures of actuators on one end block. Say what these are, a row for each with member, "
        "gamma_deg, length_mm, inner_radius_mm and outer_radius_mm: data.members=FILE, or members=… in Python; or give "
        "the columns other names, where the table is of one actuator."
    )


def _unmeasured(header: list[str], columns: Columns) -> list[str]:
    """A sentence where a bed measures less than it might."""
    absent = [name for name in columns.measured if name not in header]
    return [f"The table has no {name}: only the other readings are fitted and scored." for name in absent]
