"""The table in a sheet of cells: where its header lies, its columns by name, and what stands between its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from freelearn.common.errors import UserError
from freelearn.data.intake.headings import heading
from freelearn.data.intake.laboratory_units import dimension
from freelearn.data.intake.readers.cells import Grid, NoTable, Row, few, is_blank, is_number
from freelearn.data.intake.readers.raw_table import RawTable, unique_names
from freelearn.data.intake.readers.told_elsewhere import told_of
from freelearn.data.intake.recipes.recipe import Reading
from freelearn.data.table.records import MOST_COLUMNS

# So many rows are looked at to find the header.
LOOKED_AT = 400
# Above the names of the columns so many rows of numbers, and of further titles, may stand.
FEW_NUMBERS, MOST_TITLES = 2, 3
# A list of names and numbers above the header is no longer than this.
LONGEST_LIST = 40


def first_row(grid: Grid, rows: list[Row], reading: Reading) -> int:
    """The place of the first row of numbers. Raises UserError where there is none."""
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
        looks = (
            bool(numeric) and len(cells) >= min(width, 2) and 2 * numeric >= len(filled) and len(filled) * 3 >= width
        )
        if looks and not _names_one_thing(rows, place) and not _above_the_header(rows, place):
            return place
    if all(not is_number(cell) for _, cells in rows for cell in cells) and len(rows) == 1:
        raise NoTable(f"{grid.name} holds no rows: there is only a header. Add the measurements below it.")
    raise NoTable(f"{grid.name} holds no rows of numbers: look whether it is the right file, or set read.header.")


def _names_one_thing(rows: list[Row], place: int) -> bool:
    """Whether a row is one of a list above the header, such as "Länge; 150; mm", and not the first of the table's."""
    cells = [cell.strip() for cell in rows[place][1]]
    if is_number(next(filter(None, cells))):
        return False
    later = [row for _, row in rows[place + 1 : place + 1 + LOOKED_AT]]
    for column, cell in enumerate(cells):
        there = [row[column] for row in later if column < len(row) and row[column].strip()]
        if cell and not is_number(cell) and 2 * sum(map(is_number, there)) > len(later):
            return True
    before = [row for _, row in rows[:place]]
    return any(
        sum(bool(cell.strip()) for cell in row) > 1 and not any(map(is_number, row)) and row not in before
        for row in later[:LONGEST_LIST]
    )


def _above_the_header(rows: list[Row], place: int) -> bool:
    """Whether a row of numbers, such as those of markers, stands alone above the names of the columns."""
    for at in range(place + 1, min(place + 1 + FEW_NUMBERS + MOST_TITLES, len(rows))):
        cells = [cell.strip() for cell in rows[at][1]]
        words = [cell for cell in cells if cell and not is_number(cell) and not is_blank(cell)]
        if any(map(is_number, cells)):
            if at > place + FEW_NUMBERS:
                return False
        elif 2 * len(words) >= _usual_width(rows) and rows[at][1] not in [row for _, row in rows[:place]]:
            return not _is_units(rows[at][1])
    return False


def header_of(grid: Grid, rows: list[Row], first: int, reading: Reading) -> tuple[list[str], list[str], list[str]]:
    """Header, row of units (blank where there is none), and notes. Raises UserError."""
    width = len(rows[first][1])
    if reading.names:
        return list(reading.names), [], []
    above = list(range(first))
    if reading.header is not None:
        above = [i for i in above if rows[i][0] >= reading.header]
    if not above:
        _refuse_transposed(grid, rows, reading)
        return [""] * width, [], [f"{grid.name} has no header: its columns are called column 1, column 2, …"]
    units: list[str] = []
    place = above[-1]
    units_wanted = reading.units_row if reading.units_row is not None else len(above) > 1 and _is_units(rows[place][1])
    if units_wanted and len(above) > 1:
        units, place = rows[place][1], above[-2]
    if reading.header is not None:
        place = above[0]
    line, header = rows[place][0], _with_groups(rows, place)
    filled = len([cell for cell in header if cell.strip()])
    if 2 * filled < width:
        raise UserError(
            f"{grid.name}: line {line}, above the first row of numbers, names only {filled} of {width} columns: "
            "give the header's line as read: {header: …}, or the names as read: {names: […]}."
        )
    notes = []
    skipped = [rows[i][0] for i in range(place)]
    if skipped:
        notes.append(f"{grid.name}: lines before the header (line {line}) were passed over: {few(skipped)}.")
    return [*header, *[""] * (width - len(header))], units, notes


def _with_groups(rows: list[Row], place: int) -> list[str]:
    """The header at a place. A row of names of groups right above it (Sensor 1, , Sensor 2, ) names columns that have
    no name there, and tells those of one name apart."""
    line, header = rows[place]
    above = rows[place - 1] if place else (0, [])
    groups = [cell.strip() for cell in above[1]]
    if above[0] != line - 1 or sum(map(bool, groups)) < 2 or any(map(is_number, groups)):
        return header
    groups += [""] * (len(header) - len(groups))
    names = [cell.strip() or group for cell, group in zip(header, groups, strict=False)]
    spread = [next((g for g in reversed(groups[: i + 1]) if g), "") for i in range(len(names))]
    twice = {name for name in names if names.count(name) > 1}
    return [f"{group} {n}".strip() if n in twice and group != n else n for n, group in zip(names, spread, strict=True)]


def _refuse_transposed(grid: Grid, rows: list[Row], reading: Reading) -> None:
    """A file without a header whose rows begin with names of quantities has its quantities in rows."""
    names = [cells[0].strip() for _, cells in rows]
    told = [name for name in names if not is_number(name) and heading(name).quantity]
    distinct = len(set(names)) == len(names) > 2
    if reading.header is not None or not distinct or 2 * len(told) <= len(names):
        return
    if all(is_number(cell) or is_blank(cell) for _, cells in rows for cell in cells[1:]):
        shown = ", ".join(told[:4])
        raise UserError(f"{grid.name} has a quantity in each row ({shown}): transpose it, so that each has a column.")


def _is_units(cells: Sequence[str]) -> bool:
    """Whether a row says the units of columns."""
    filled = [cell.strip() for cell in cells if cell.strip() and cell.strip() != "-"]
    bare = [cell.strip("[]()") for cell in filled]
    return bool(filled) and sum(dimension(cell) is not None for cell in bare) * 3 >= 2 * len(bare)


def _usual_width(rows: list[Row]) -> int:
    return Counter(len(cells) for _, cells in rows[:LOOKED_AT]).most_common(1)[0][0]


# The table in a sheet of cells: its columns under their names, and what stands between its rows.


def table_of(grid: Grid, reading: Reading) -> RawTable:
    """The table in a grid. Raises UserError where there is none, or its rows do not fit its header."""
    rows = [(line, cells) for line, cells in grid.rows if any(cell.strip() for cell in cells)]
    if not rows:
        raise NoTable(f"{grid.name} is empty: it needs a header and rows.")
    line, widest = max(rows, key=lambda row: len(row[1]))
    if len(widest) > MOST_COLUMNS:
        raise UserError(f"{grid.name} has {len(widest)} columns, more than any table has: look at line {line}.")
    first = first_row(grid, rows, reading)
    header, units, notes = header_of(grid, rows, first, reading)
    head = [*grid.comments, *rows[:first]]
    about = tuple(told_of(head, grid.style, grid.name))
    names, width = unique_names(header), len(header)
    kept, more = _fitting(grid, rows[first:], width, [header, units])
    if not kept:
        raise NoTable(f"{grid.name} holds no rows: there is only a header. Add the measurements below it.")
    columns = {name: [cells[place] for _, cells in kept] for place, name in enumerate(names)}
    said = {name: unit for name, unit in zip(names, units, strict=False) if unit.strip()}
    empty = {n for n, cells in columns.items() if n.startswith("column ") and not any(c.strip() for c in cells)}
    columns = {name: cells for name, cells in columns.items() if name not in empty}
    lines = [line for line, _ in kept]
    every = (*grid.notes, *notes, *more)
    return RawTable(grid.name, columns, lines, grid.style, said, every, about, tuple(head), grid.texts)


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
        rows_end = "1 row ends early and was" if len(short) == 1 else f"{len(short)} rows end early and were"
        notes.append(f"{grid.name}: {rows_end} filled with blanks: {_lines(short)}.")
    if repeated:
        notes.append(f"{grid.name}: the header stands there again and was passed over: {_lines(repeated)}.")
    if remarks:
        notes.append(f"{grid.name}: what holds no readings was passed over: {_lines(remarks)}.")
    return kept, notes


def _lines(lines: list[int]) -> str:
    return f"line{'s' if len(lines) > 1 else ''} {few(lines)}"
