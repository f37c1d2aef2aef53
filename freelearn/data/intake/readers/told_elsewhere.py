"""What a file says of the actuator outside its table: "Länge [mm]: 300" above the header, or on a title sheet."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from freelearn.common.errors import UserError
from freelearn.data.intake.headings import INNER_DIAMETER, WALL, heading
from freelearn.data.intake.laboratory_units import conversion, unit_of
from freelearn.data.intake.readers.cells import Row, Style, is_number

OUTER_DIAMETER = "outer_diameter_mm"
# Quantity → the table's column and the factor to it; a wall is added to the inner radius.
DESIGNS = {
    "gamma_deg": ("gamma_deg", 1.0),
    "gamma2_deg": ("gamma2_deg", 1.0),
    "length_mm": ("length_mm", 1.0),
    "inner_radius_mm": ("inner_radius_mm", 1.0),
    "outer_radius_mm": ("outer_radius_mm", 1.0),
    INNER_DIAMETER: ("inner_radius_mm", 0.5),
    OUTER_DIAMETER: ("outer_radius_mm", 0.5),
    WALL: (WALL, 1.0),
}
_PAIR = re.compile(r"([^=:]{1,60}?)\s*[=:]\s*(\S.*)")
_WITH_UNIT = re.compile(r"([+\-−]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(.*)")


@dataclass(frozen=True)
class Told:
    """value: of the table's column `name`, in its unit. words: where it stands, and how. member: of which of several
    actuators on one end block, 0 for all. unit_said: whether the file says the unit."""

    name: str
    value: float
    words: str
    member: int = 0
    unit_said: bool = True


def told_of(rows: Sequence[Row], style: Style, where: str) -> list[Told]:
    """Parts of the design in rows of names and numbers. where: what to call the place, such as a sheet.

    >>> (told,) = told_of([(4, ["Innendurchmesser [mm]", "20"])], Style(), "a.csv")
    >>> told.name, told.value, told.words
    ('inner_radius_mm', 10.0, 'a.csv, line 4: Innendurchmesser [mm] 20')
    """
    found: dict[str, Told] = {}
    for line, cells in rows:
        for name, value, unit in pairs_of(cells):
            told = one_told(name, value, unit, style, f"{where}, line {line}")
            if told is not None:
                found.setdefault(told.name, told)
    return with_the_wall(found)


def with_the_wall(found: dict[str, Told]) -> list[Told]:
    """The parts of the design; a wall makes the outer radius, if the inner one is there."""
    if (wall := found.pop(WALL, None)) and "outer_radius_mm" not in found and "inner_radius_mm" in found:
        inner = found["inner_radius_mm"]
        found["outer_radius_mm"] = Told("outer_radius_mm", inner.value + wall.value, wall.words)
    return list(found.values())


def pairs_of(cells: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Name, number and unit of neighboring cells, or of one cell with a colon or an equals sign."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    for place, cell in enumerate(filled):
        after = filled[place + 1 : place + 3]
        if pair := _PAIR.fullmatch(cell):
            yield pair[1], pair[2], ""
        elif after and not is_number(cell):
            unit = after[1] if len(after) > 1 and not is_number(after[1]) else ""
            yield cell.rstrip(" :="), after[0], unit


def one_told(name: str, value: str, unit: str, style: Style, where: str) -> Told | None:
    """A part of the design; None where the name, or the unit, tells none."""
    said = heading(name)
    if said.quantity not in DESIGNS or not (match := _WITH_UNIT.fullmatch(value)):
        return None
    number = style.number(match[1])
    written = match[2].strip() or said.unit or unit.strip().strip("[]()")
    column, factor = DESIGNS[said.quantity]
    if number is None or number != number or not written:
        return None
    try:
        change = conversion(written, "mm" if column == WALL else unit_of(column))
    except UserError:
        return None
    made = float(f"{factor * (change.factor * number + change.shift):.12g}")
    # What is given as a word beside it stands there as well: 300 mm.
    shown = f"{name} {value}" if match[2] or said.unit else f"{name} {value} {written}"
    return Told(column, made, f"{where}: {shown}")
