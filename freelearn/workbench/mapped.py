"""What the columns of a laboratory's file were said to be, as a recipe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from freelearn.errors import UserError
from freelearn.measurements.intake.draft import quoted
from freelearn.workbench.quantities import DERIVED, MARK_OF, table_column


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
    return "\n".join([*lines, *_steps_and_marks(columns)]) + "\n"


def _once(used: Sequence[MappedColumn], columns: Sequence[MappedColumn]) -> None:
    first: dict[str, MappedColumn] = {}
    for column in [*used, *(c for c in columns if c.quantity in ("sample", "step", *MARK_OF))]:
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


def _steps_and_marks(columns: Sequence[MappedColumn]) -> list[str]:
    step = next((f"{{from: {quoted(c.name)}}}" for c in columns if c.quantity == "step"), "derive")
    marks = [f"{MARK_OF[c.quantity]}: {{{quoted(c.name)}: 1}}" for c in columns if c.quantity in MARK_OF]
    return [f"step: {step}", *marks]


def _entry(column: MappedColumn) -> str:
    keys = [f"from: {quoted(column.name)}", f"unit: {quoted(column.unit)}"]
    # A contraction is a negative strain.
    if column.turned != (column.quantity == "contraction"):
        keys.append("sign: -1")
    if column.offset:
        keys.append(f"offset: {column.offset!r}")
    return f"{{{', '.join([*keys, *DERIVED.get(column.quantity, ())])}}}"
