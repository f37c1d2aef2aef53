"""LabVIEW's measurement files of text (.lvm): what of their lines is a table, under headings with their units."""

from __future__ import annotations

from collections.abc import Sequence

MAGIC, END = "LabVIEW Measurement", "***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ","}


def is_labview(lines: Sequence[str]) -> bool:
    """Whether the lines are those of such a file."""
    return bool(lines) and lines[0].startswith(MAGIC)


def table_lines(lines: Sequence[str], name: str) -> tuple[list[str], str, list[str]]:
    """The lines with those blank that are no rows of the table, whose separator it gives, too; and notes. Each segment
    has a header of its own, of which the first names the columns; the times of a segment that holds none are counted
    from its first and its step."""
    separator = next((mark for word, mark in SEPARATORS.items() if _said(lines, "Separator") == [word]), "\t")
    out, counted, segments = [""] * len(lines), 0, 0
    about: dict[str, list[str]] = {}
    within, named = True, False
    for place, line in enumerate(lines):
        cells = [cell.strip() for cell in line.rstrip("\r\n").split(separator)]
        if line.startswith((MAGIC, "Channels")):
            within, about = True, {} if line.startswith("Channels") else about
        elif cells[0] == END:
            within, named = False, False
        elif within and cells[0]:
            about[cells[0]] = cells[1:]
        elif not within and any(cells) and not named:
            named, counted, segments = True, 0, segments + 1
            out[place] = separator.join(_headed(cells, about)) + "\n" if segments == 1 else "\n"
        elif not within and any(cells):
            out[place] = separator.join(_timed(cells, about, counted)) + "\n"
            counted += 1
    many = "one segment" if segments == 1 else f"{segments} segments"
    return out, separator, [f"{name}: a LabVIEW measurement of {many}, with the units of its header."]


def _said(lines: Sequence[str], key: str) -> list[str]:
    return next((line.split()[1:] for line in lines[:40] if line.split()[:1] == [key]), [])


def _headed(cells: list[str], about: dict[str, list[str]]) -> list[str]:
    """The names of a segment's columns with their units; its times are called so."""
    units = iter(about.get("Y_Unit_Label", []))
    dimensions = iter(about.get("X_Dimension", []))
    headed = []
    for cell in cells:
        if cell == "X_Value":
            headed.append("X_Value, Time [s]" if next(dimensions, "Time") in ("Time", "") else cell)
        else:
            unit = next(units, "") if cell and cell != "Comment" else ""
            headed.append(f"{cell} [{unit}]" if unit else cell)
    return headed


def _timed(cells: list[str], about: dict[str, list[str]], counted: int) -> list[str]:
    """A row's cells, with its time where the file leaves that out."""
    first, step = (about.get(key, [""])[0].replace(",", ".") for key in ("X0", "Delta_X"))
    if cells[0] or not first or not step:
        return cells
    return [repr(float(first) + counted * float(step)), *cells[1:]]
