"""The table in a sheet of cells: its columns under their names, and what stands between its rows."""

from __future__ import annotations

from freelearn.errors import UserError
from freelearn.measurements.intake.cells import is_blank, is_number
from freelearn.measurements.intake.grid import Grid, NoTable, Row, few
from freelearn.measurements.intake.grid_header import first_row, header_of
from freelearn.measurements.intake.raw_table import RawTable, unique_names
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.told_elsewhere import told_of
from freelearn.measurements.records import MOST_COLUMNS


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
    return RawTable(grid.name, columns, lines, grid.style, said, (*grid.notes, *notes, *more), about, tuple(head))


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
