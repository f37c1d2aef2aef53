"""The constants of a recipe: what is the same in all rows, or in all of an actuator."""

from __future__ import annotations

from freelearn.errors import UserError
from freelearn.measurements.intake.recipe import QUANTITIES, Constants
from freelearn.measurements.intake.section import Section
from freelearn.measurements.intake.units import conversion, unit_of


def constants_of(section: Section) -> Constants:
    """Constants in the table's units; each a number, or {value: …, unit: …}."""
    section.only(QUANTITIES, "column of the table")
    constants = {}
    for name, value in section.items():
        if name not in QUANTITIES:
            continue
        whole = isinstance(value, dict)
        number = _with_unit(section.section(name), name) if whole else section.number(name)
        if number is not None:
            constants[name] = number
    return constants


def _with_unit(section: Section, name: str) -> float | None:
    section.only(("value", "unit"))
    value = section.number("value")
    if value is None or "unit" not in section:
        section.say("needs value: and unit:")
        return None
    try:
        change = conversion(section.text("unit"), unit_of(name))
    except UserError as mistake:
        section.say(str(mistake))
        return None
    return change.factor * value + change.shift
