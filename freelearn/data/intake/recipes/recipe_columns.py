"""The columns, conditions and constants of a recipe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from freelearn.common.errors import UserError
from freelearn.data.intake.laboratory_units import conversion, unit_of
from freelearn.data.intake.recipes.recipe import DATE, QUANTITIES, Column, Condition, Constants, Term, Test
from freelearn.data.intake.recipes.recipe_section import Section, is_number

# The conditions of a recipe: which cells rows must have.

TEST_KEYS = ("is", "is_not", "below", "above", "blank")


def condition_of(section: Section) -> Condition:
    """Column → test; empty conditions are mistakes."""
    if not section.content:
        section.say("is empty: write column: value")
    return {name: _test(value, section, name) for name, value in section.items()}


def _test(value: Any, section: Section, name: str) -> Test:
    if value == "blank" or value is None:
        return Test(blank=True)
    if isinstance(value, dict):
        inner = section.section(name)
        inner.only(TEST_KEYS)
        if not inner.content:
            inner.say(f"tests nothing: write one of {', '.join(TEST_KEYS)}")
        below, above = inner.number("below"), inner.number("above")
        return Test(_cells(inner, "is"), _cells(inner, "is_not"), below, above, inner.switch("blank"))
    return Test(is_=_cells(section, name))


def _cells(section: Section, key: str) -> tuple[str | float, ...]:
    value = section.content.get(key)
    several = value if isinstance(value, list) else [] if value is None else [value]
    if not all(isinstance(one, str) or is_number(one) for one in several):
        section.say(f"is {value!r}: write texts or numbers", key)
        return ()
    return tuple(one if isinstance(one, str) else float(one) for one in several)


def conditions_of(section: Section, key: str) -> tuple[Condition, ...]:
    """One condition or a list of them."""
    value = section.content.get(key)
    if isinstance(value, Mapping):
        return (condition_of(section.section(key)),)
    return tuple(condition_of(one) for one in section.sections(key))


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


# The columns of a recipe: how a quantity comes of a column of the file.

COLUMN_KEYS = (
    "from",
    "unit",
    "sign",
    "scale",
    "offset",
    "times",
    "plus",
    "minus",
    "blank_where",
    "blanks",
    "fill",
    "correct",
    "even",
)


def columns_of(section: Section) -> dict[str, Column]:
    """Columns of the table, each from one of the file."""
    section.only(QUANTITIES, "column of the table")
    return {name: column_of(section.section(name), name) for name, _ in section.items() if name in QUANTITIES}


def column_of(section: Section, name: str) -> Column:
    """The column of the table called `name`."""
    section.only(COLUMN_KEYS)
    if "from" not in section:
        section.say("names no column of the file: add from:")
    times = section.text("times") or None
    if times and unit_of(times) != unit_of(name):
        section.say(f"is {times!r}: name a column of the table in the same unit, such as length_mm", "times")
    unit = _unit(section, "" if times else unit_of(name))
    sign = section.content.get("sign", 1)
    if sign not in (1, -1) or isinstance(sign, bool):
        section.say(f"is {sign!r}: write 1 or -1", "sign")
    scale = section.number("scale", 1.0) or 0.0
    if scale == 0:
        section.say("is 0: give the factor from the reading to its unit", "scale")
    return Column(
        source=section.text("from"),
        unit=unit,
        sign=-1 if sign == -1 else 1,
        scale=scale,
        offset=_offset(section),
        times=times,
        plus=_terms(section, "plus", name),
        minus=_terms(section, "minus", name),
        blank_where=condition_of(section.section("blank_where")) if "blank_where" in section else None,
        fill="above" if section.content.get("fill") == "above" else section.number("fill"),
        blanks=section.texts("blanks"),
        correct=_corrections(section.section("correct")),
        even=_even(section, name),
    )


def _even(section: Section, name: str) -> bool:
    if "even" in section and name != "time_s":
        section.say("is for a time alone: leave it out", "even")
    return bool(section.switch("even"))


def _corrections(section: Section) -> tuple[tuple[float, float], ...]:
    """Readings that are wrong, with the right ones: {0.25: 0.2516}."""
    pairs = []
    for wrong, _ in section.items():
        right = section.number(wrong)
        if not is_number(_number(wrong)):
            section.say("is no reading: write {what it reads: what is right}", wrong)
        elif right is not None:
            pairs.append((float(wrong), right))
    return tuple(pairs)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _unit(section: Section, wanted: str) -> str:
    if "unit" not in section and wanted:
        section.say(f"has no unit: add unit: (the table's is {wanted.replace('*', '·')})")
        return ""
    unit = section.text("unit")
    if wanted == "s" and unit == DATE:
        return unit
    try:
        conversion(unit, wanted)
    except UserError as mistake:
        section.say(str(mistake))
    return unit


def _offset(section: Section) -> float | Literal["rest"]:
    return "rest" if section.content.get("offset") == "rest" else section.number("offset", 0.0) or 0.0


def _terms(section: Section, key: str, name: str) -> tuple[Term, ...]:
    value = section.content.get(key)
    if value is None:
        return ()
    return tuple(_term(one, section, key, name) for one in (value if isinstance(value, list) else [value]))


def _term(value: Any, section: Section, key: str, name: str) -> Term:
    """A term in the unit of the column `name`."""
    wanted = unit_of(name)
    if is_number(value):
        return Term(number=float(value))
    if isinstance(value, str):
        if value not in QUANTITIES or unit_of(value) != wanted or value == name:
            section.say(
                f"is {value!r}: name another column of the table in {wanted}, or write {{from: …, unit: …}}", key
            )
        return Term(column=value)
    inner = Section(value, section.at(key), section.mistakes)
    inner.only(("from", "unit", "pressure_on"))
    if "pressure_on" not in inner:
        if "from" not in inner:
            inner.say(
                "names nothing: write a number, a column of the table, {from: …, unit: …} or {pressure_on: radius}"
            )
        return Term(source=inner.text("from"), unit=_unit(inner, wanted))
    if wanted != "N":
        inner.say("is a force: only a column in newtons can have it", "pressure_on")
    return Term(thrust_on=_term(inner.content["pressure_on"], inner, "pressure_on", "radius_mm"))
