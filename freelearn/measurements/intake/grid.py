"""Where the table lies in a sheet of cells: titles, header, row of units, rows, and what stands between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from freelearn.errors import UserError
from freelearn.measurements.intake.cells import POINTS, Style, is_blank, is_number
from freelearn.measurements.intake.raw_table import RawTable, unique_names
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.units import dimension

Row = tuple[int, list[str]]
# So many rows are looked at to find the header.
LOOKED_AT = 400


@dataclass(frozen=True)
class Grid:
    """rows: (line, cells) of every line that is neither blank nor a comment, but for one that names the columns.
    cut_off: the file ends inside a line."""

    name: str
    rows: list[Row]
    style: Style = POINTS
    notes: list[str] = field(default_factory=list)
    cut_off: bool = False


def table_of(grid: Grid, reading: Reading) -> RawTable:
    """The table in a grid. Raises UserError where there is none, or its rows do not fit its header."""
    rows = [(line, cells) for line, cells in grid.rows if any(cell.strip() for cell in cells)]
    if not rows:
        raise UserError(f"{grid.name} is empty: it needs a header and rows.")
    first = _first_row(grid, rows, reading)
    header, units, notes = _header(grid, rows, first, reading)
    names, width = unique_names(header), len(header)
    kept, more = _fitting(grid, rows[first:], width, [header, units])
    if not kept:
        raise UserError(f"{grid.name} holds no rows: there is only a header. Add the measurements below it.")
    columns = {name: [cells[place] for _, cells in kept] for place, name in enumerate(names)}
    said = {name: unit for name, unit in zip(names, units, strict=False) if unit.strip()}
    empty = [n for n, cells in columns.items() if n.startswith("column ") and not any(c.strip() for c in cells)]
    columns = {name: cells for name, cells in columns.items() if name not in empty}
    lines = [line for line, _ in kept]
    return RawTable(grid.name, columns, lines, grid.style, said, (*grid.notes, *notes, *more))


def _first_row(grid: Grid, rows: list[Row], reading: Reading) -> int:
    """The place of the first row of numbers."""
    if reading.header is not None:
        places = [i for i, (line, _) in enumerate(rows) if line > reading.header]
        if reading.header not in [line for line, _ in rows]:
            raise UserError(f"{grid.name} has nothing on line {reading.header}: correct read.header.")
        if not places:
            raise UserError(f"{grid.name} holds no rows below line {reading.header}: correct read.header.")
        units = reading.units_row
        looks = units is None and _is_units(rows[places[0]][1])
        return places[1] if (units or looks) and len(places) > 1 else places[0]
    width = _usual_width(rows)
    for place, (_, cells) in enumerate(rows[:LOOKED_AT]):
        filled = [cell for cell in cells if cell.strip()]
        numeric = sum(is_number(cell) for cell in filled)
        if len(cells) >= min(width, 2) and numeric and 2 * numeric >= len(filled) and len(filled) * 3 >= width:
            return place
    if all(not is_number(cell) for _, cells in rows for cell in cells) and len(rows) == 1:
        raise UserError(f"{grid.name} holds no rows: there is only a header. Add the measurements below it.")
    raise UserError(f"{grid.name} holds no rows of numbers: look whether it is the right file, or set read.header.")


def _header(grid: Grid, rows: list[Row], first: int, reading: Reading) -> tuple[list[str], list[str], list[str]]:
    """Header, row of units (blank where there is none), and notes."""
    width = len(rows[first][1])
    if reading.names:
        return list(reading.names), [], []
    above = list(range(first))
    if reading.header is not None:
        above = [i for i in above if rows[i][0] >= reading.header]
    if not above:
        return [""] * width, [], [f"{grid.name} has no header: its columns are called column 1, column 2, …"]
    units: list[str] = []
    place = above[-1]
    units_wanted = reading.units_row if reading.units_row is not None else len(above) > 1 and _is_units(rows[place][1])
    if units_wanted and len(above) > 1:
        units, place = rows[place][1], above[-2]
    if reading.header is not None:
        place = above[0]
    line, header = rows[place]
    filled = len([cell for cell in header if cell.strip()])
    if 2 * filled < width:
        raise UserError(
            f"{grid.name}: line {line}, above the first row of numbers, names only {filled} of {width} columns: "
            "give the header's line as read: {header: …}, or the names as read: {names: […]}."
        )
    notes = []
    skipped = [rows[i][0] for i in range(place)]
    if skipped:
        notes.append(f"{grid.name}: lines before the header (line {line}) were passed over: {_few(skipped)}.")
    return [*header, *[""] * (width - len(header))], units, notes


def _is_units(cells: Sequence[str]) -> bool:
    """Whether a row says the units of columns."""
    filled = [cell.strip() for cell in cells if cell.strip() and cell.strip() != "-"]
    bare = [cell.strip("[]()") for cell in filled]
    return bool(filled) and sum(dimension(cell) is not None for cell in bare) * 3 >= 2 * len(bare)


def _fitting(grid: Grid, rows: list[Row], width: int, titles: list[list[str]]) -> tuple[list[Row], list[str]]:
    """The rows as wide as the header, and notes on those that were not. Raises UserError where cells are left over."""
    kept: list[Row] = []
    repeated, remarks, short = [], [], []
    known = [[cell.strip() for cell in title] for title in titles if any(title)]
    for line, cells in rows:
        stripped = [cell.strip() for cell in cells]
        filled = [cell for cell in stripped if cell]
        if any(stripped[: len(title)] == title[: len(stripped)] and len(filled) > 1 for title in known):
            repeated.append(line)
        elif len(filled) == 1 and width > 2 and not is_number(filled[0]) and not is_blank(filled[0]):
            remarks.append(line)
        elif any(stripped[width:]):
            raise UserError(
                f"{grid.name}, line {line}: {len(cells)} values for {width} columns: look for a decimal comma in a "
                "file with commas between columns, or for a cell too many."
            )
        else:
            if len(cells) < width:
                short.append(line)
            kept.append((line, [*cells[:width], *[""] * (width - len(cells))]))
    notes = []
    if short and grid.cut_off and kept and kept[-1][0] == short[-1]:
        kept.pop()
        notes.append(f"{grid.name}: the last line, {short.pop()}, is cut off and was left out.")
    if short:
        notes.append(f"{grid.name}: {len(short)} rows end early and were filled with blanks: lines {_few(short)}.")
    if repeated:
        notes.append(f"{grid.name}: the header stands there again and was passed over: lines {_few(repeated)}.")
    if remarks:
        notes.append(f"{grid.name}: lines without readings were passed over: {_few(remarks)}.")
    return kept, notes


def _usual_width(rows: list[Row]) -> int:
    return Counter(len(cells) for _, cells in rows[:LOOKED_AT]).most_common(1)[0][0]


def _few(lines: Sequence[int], most: int = 5) -> str:
    shown = ", ".join(map(str, lines[:most]))
    return f"{shown} and {len(lines) - most} more" if len(lines) > most else shown
