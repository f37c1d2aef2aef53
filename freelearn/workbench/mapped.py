"""What the columns of a laboratory's file were said to be, as a recipe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from freelearn.errors import UserError
from freelearn.measurements.intake.draft import quoted

# What a column can be → its kind of unit. Those that intake's table has only after a conversion stand in DERIVED.
QUANTITIES = {
    "not used": "",
    "sample": "",
    "elongation": "length",
    "held length": "length",
    "stretch": "ratio",
    "strain": "ratio",
    "contraction": "ratio",
    "twist": "angle",
    "pressure": "pressure",
    "force": "force",
    "moment": "moment",
    "outer diameter": "length",
    "time": "time",
    "temperature": "temperature",
    "fiber angle": "angle",
    "angle of a second family": "angle",
    "unloaded length": "length",
    "inner radius": "length",
    "outer radius": "length",
}
# In the table's own unit first.
UNITS = {
    "length": ("mm", "cm", "m", "µm", "in"),
    "ratio": ("1", "%"),
    "angle": ("deg", "rad", "turn"),
    "pressure": ("kPa", "Pa", "MPa", "bar", "mbar", "psi", "mmHg"),
    "force": ("N", "mN", "kN", "lbf", "gf", "kgf", "ozf"),
    "moment": ("N·mm", "N·m", "mN·m", "N·cm", "lbf·in", "lbf·ft", "ozf·in"),
    "time": ("s", "ms", "min", "h"),
    "temperature": ("°C", "K", "°F"),
}
COLUMNS = {
    "elongation": "elongation_mm",
    "twist": "twist_deg",
    "pressure": "pressure_kpa",
    "force": "force_n",
    "moment": "moment_nmm",
    "outer diameter": "outer_diameter_mm",
    "time": "time_s",
    "temperature": "temperature_c",
    "fiber angle": "gamma_deg",
    "angle of a second family": "gamma2_deg",
    "unloaded length": "length_mm",
    "inner radius": "inner_radius_mm",
    "outer radius": "outer_radius_mm",
}
# Further keys of a column of elongations.
DERIVED = {
    "held length": ("minus: length_mm",),
    "stretch": ("times: length_mm", "minus: length_mm"),
    "strain": ("times: length_mm",),
    "contraction": ("times: length_mm",),
}


@dataclass(frozen=True)
class MappedColumn:
    """quantity: of QUANTITIES. offset: what it reads where it should read 0. words: of a column of samples, the words
    that stand for 1, 2, …"""

    name: str
    quantity: str
    unit: str = ""
    turned: bool = False
    offset: float = 0.0
    words: tuple[str, ...] = ()


def table_column(quantity: str) -> str:
    """The column of the table that a quantity becomes; "" for none.

    >>> table_column("stretch"), table_column("not used")
    ('elongation_mm', '')
    """
    return "elongation_mm" if quantity in DERIVED else COLUMNS.get(quantity, "")


def recipe_of_choices(
    bed: str,
    columns: Sequence[MappedColumn],
    constants: Mapping[str, float],
    angles: Sequence[float] = (),
    about: str = "",
) -> str:
    """The recipe's text. constants: in the table's units. angles: fiber angles of several actuators in parallel, whose
    pressures are columns. Raises UserError where two columns are one thing."""
    pressures = [column for column in columns if column.quantity == "pressure"]
    several = len(pressures) > 1
    if several and len(angles) != len(pressures):
        raise UserError(
            f"{len(pressures)} columns are pressures, so there are as many actuators: give {len(pressures)} fiber "
            f"angles, not {len(angles)}."
        )
    used = [c for c in columns if table_column(c.quantity) and not (several and c.quantity == "pressure")]
    _once(used, columns)
    lines = [f"about: {quoted(about)}"] if about else []
    lines += [f"bed: {bed}", _sample(columns)]
    known = {table_column(column.quantity) for column in used}
    given = {name: value for name, value in constants.items() if name not in known and math.isfinite(value)}
    lines.append("constants:" if given else "constants: {}")
    lines += [f"  {name}: {value!r}" for name, value in given.items()]
    lines.append("columns:" if used else "columns: {}")
    lines += [f"  {table_column(column.quantity)}: {_entry(column)}" for column in used]
    if several:
        lines.append("members:")
        for column, angle in zip(pressures, angles, strict=True):
            lines += [f"  - pressure: {_entry(column)}", f"    gamma_deg: {angle!r}"]
    return "\n".join([*lines, "step: derive"]) + "\n"


def _once(used: Sequence[MappedColumn], columns: Sequence[MappedColumn]) -> None:
    first: dict[str, MappedColumn] = {}
    for column in [*used, *(c for c in columns if c.quantity == "sample")]:
        name = table_column(column.quantity) or column.quantity
        if name in first:
            raise UserError(
                f"The columns {first[name].name!r} and {column.name!r} are both the {column.quantity}: keep one, and "
                "say of the other that it is not used."
            )
        first[name] = column


def _sample(columns: Sequence[MappedColumn]) -> str:
    column = next((c for c in columns if c.quantity == "sample"), None)
    if column is None:
        return "sample: 1"
    words = ", ".join(f"{quoted(word)}: {number}" for number, word in enumerate(column.words, start=1))
    return f"sample: {{from: {quoted(column.name)}{f', as: {{{words}}}' if words else ''}}}"


def _entry(column: MappedColumn) -> str:
    keys = [f"from: {quoted(column.name)}", f"unit: {quoted(column.unit)}"]
    # A contraction is a negative strain.
    if column.turned != (column.quantity == "contraction"):
        keys.append("sign: -1")
    if column.offset:
        keys.append(f"offset: {column.offset!r}")
    return f"{{{', '.join([*keys, *DERIVED.get(column.quantity, ())])}}}"
