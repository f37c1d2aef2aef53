"""The guess at a file with several sheets, and at designs that stand in another sheet or file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from freelearn.errors import UserError
from freelearn.measurements.intake.guess import HELD, ColumnGuess, Guess, column_guess, guess_table
from freelearn.measurements.intake.headings import INNER_DIAMETER
from freelearn.measurements.intake.raw_file import raw_table, sheet_names
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.recipe import DESIGN
from freelearn.measurements.text_file import read_bytes

# What a column of designs may be called otherwise, and how it becomes the table's.
STANDS_FOR = {HELD: ("length_mm", 1.0), INNER_DIAMETER: ("inner_radius_mm", 0.5)}
OUTER_DIAMETER = ("outer_radius_mm", 0.5)


@dataclass(frozen=True)
class DesignGuess:
    """file: "" for a sheet of the data's workbook. sample: the column of the data that names the actuators. columns:
    of the table → the column of the designs and its factor."""

    file: str
    sheet: str
    by: str
    sample: str
    words: tuple[str, ...]
    columns: dict[str, tuple[ColumnGuess, float]]


def guess_file(path: Path, design: Path | None = None) -> tuple[Guess, DesignGuess | None]:
    """The guess at a file, of its sheets the one that holds readings; and the designs that are joined with it. design:
    their file, where they have one. Raises UserError."""
    content = read_bytes(path)
    names = sheet_names(content, path.name)
    if len(names) < 2:
        raw = raw_table(content, path.name)
        found = guess_table(raw)
        others: list[tuple[str, RawTable]] = []
    else:
        tables = _tables(content, path.name, names)
        sheet, raw = max(tables, key=lambda one: _readings(guess_table(one[1])))
        others = [one for one in tables if one[0] != sheet]
        note = f"{path.name}: of its sheets {', '.join(map(repr, names))} {sheet!r} was read."
        found = guess_table(raw)
        found = replace(found, sheet=sheet, notes=(note, *found.notes))
    if design is not None:
        joined = _joined(found, raw, raw_table(read_bytes(design), design.name), design.name, "")
        if joined is None:
            raise UserError(
                f"{design} names no actuators as {path.name} does: it needs a column with the same words as one there, "
                "and columns of the design with their units."
            )
    else:
        made = (_joined(found, raw, table, "", sheet) for sheet, table in others)
        joined = next((one for one in made if one is not None), None)
    return found, joined


def _tables(content: bytes, name: str, sheets: Sequence[str]) -> list[tuple[str, RawTable]]:
    """The sheets that hold tables. Raises UserError where none does."""
    tables, mistake = [], None
    for sheet in sheets:
        try:
            tables.append((sheet, raw_table(content, name, Reading(sheet=sheet))))
        except UserError as problem:
            mistake = mistake or problem
    if not tables:
        raise mistake or UserError(f"{name} is empty: it needs a header and rows.")
    return tables


def _readings(found: Guess) -> tuple[int, int]:
    """How much of a measurement a sheet seems to hold."""
    quantities = {"force_n", "moment_nmm", "pressure_kpa", "elongation_mm", "twist_deg"}
    return len({c.quantity for c in found.columns if c.chosen} & quantities), found.rows


def _joined(found: Guess, raw: RawTable, designs: RawTable, file: str, sheet: str) -> DesignGuess | None:
    """The designs, if a column of theirs names each actuator of a column of the data once, and others are designs."""
    columns: dict[str, tuple[ColumnGuess, float]] = {}
    for name in designs.columns:
        # Each by itself: what differs from row to row is a design here.
        column = column_guess(designs, name)
        quantity, factor = STANDS_FOR.get(column.quantity or "", (column.quantity or "", 1.0))
        if column.quantity == "outer_diameter_mm":
            quantity, factor = OUTER_DIAMETER
        if quantity in DESIGN and quantity not in columns:
            columns[quantity] = (column, factor)
    if not columns:
        return None
    likely = sorted(raw.columns, key=lambda name: (found.of("sample") or found.columns[0]).name != name)
    for by in designs.columns:
        words = [word for word in designs.text(by) if word]
        for name in likely:
            there = set(raw.text(name)) - {""}
            if len(set(words)) == len(words) and there and there <= set(words) and by not in _used(columns):
                return DesignGuess(file, sheet, by, name, tuple(words), columns)
    return None


def _used(columns: dict[str, tuple[ColumnGuess, float]]) -> set[str]:
    return {column.name for column, _ in columns.values()}
