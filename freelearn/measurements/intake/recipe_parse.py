"""From the plain values of a recipe's file to a recipe, or to one error with every mistake in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.recipe import (
    DESIGN,
    MARKS,
    QUANTITIES,
    Column,
    Condition,
    Member,
    Part,
    Plateaus,
    Recipe,
    Sample,
    Steps,
)
from freelearn.measurements.intake.recipe_check import lacking
from freelearn.measurements.intake.recipe_columns import column_of, columns_of, condition_of, constants_of
from freelearn.measurements.intake.section import Section

KEYS = (
    *("about", "bed", "read", "files", "sample", "samples", "constants", "columns", "members", "keep", "drop"),
    *("order_by", "plateaus", "rest", "state_tolerance", "step", *MARKS, "carry"),
)
READ = ("sheet", "variables", "encoding", "separator", "decimal", "thousands", "header", "names", "units_row")


def parse_recipe(content: Any, name: str) -> Recipe:
    """The recipe. content: plain values. name: of the file, for messages. Raises UserError with every mistake."""
    mistakes: list[str] = []
    root = Section(content, "", mistakes)
    root.only(KEYS)
    if "bed" not in root:
        root.say(f"says no bed: add bed: with one of {', '.join(BEDS)}")
    recipe = Recipe(
        bed=root.choice("bed", list(BEDS), "kinematic"),
        columns=columns_of(root.section("columns")),
        reading=_reading(root.section("read")),
        files=_files(root),
        sample=_sample(root) or Sample(number=1),
        constants=constants_of(root.section("constants")),
        samples=_samples(root.section("samples")),
        members=_members(root),
        keep=condition_of(root.section("keep")) if "keep" in root else None,
        drop=_conditions(root, "drop"),
        order_by=root.texts("order_by"),
        plateaus=_plateaus(root.section("plateaus")) if "plateaus" in root else None,
        rest=_rest(root),
        state_tolerance=_tolerances(root.section("state_tolerance")),
        steps=_steps(root),
        marks={mark: condition_of(root.section(mark)) for mark in MARKS if mark in root},
        carry=root.texts("carry"),
        about=root.text("about"),
    )
    mistakes += lacking(recipe) if not mistakes else []
    if mistakes:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        raise UserError("\n  ".join([f"{name} has {count}:", *dict.fromkeys(mistakes)]))
    return recipe


def _reading(section: Section) -> Reading:
    section.only(READ)
    decimal = section.text("decimal") or None
    if decimal not in (None, ".", ","):
        section.say(f"is {decimal!r}: write '.' or ','", "decimal")
    separator = section.text("separator") or None
    if separator and len(separator) != 1:
        section.say(f'is {separator!r}: write one character, "\\t" for tabs', "separator")
    return Reading(
        sheet=section.text("sheet") or None,
        variables=section.texts("variables"),
        encoding=section.text("encoding") or None,
        separator=separator,
        decimal=decimal,
        thousands=section.text("thousands") or None,
        header=section.integer("header", 1),
        names=section.texts("names"),
        units_row=section.switch("units_row"),
    )


def _sample(section: Section) -> Sample | None:
    if "sample" not in section:
        return None
    if not isinstance(section.content["sample"], Mapping):
        return Sample(number=section.integer("sample", 1))
    inner = section.section("sample")
    inner.only(("from", "as"))
    if "from" not in inner:
        inner.say("names no column of the file: add from:")
    if "as" not in inner:
        return Sample(source=inner.text("from"))
    names = inner.section("as")
    numbers = {word: names.integer(word, 1) for word, _ in names.items()}
    return Sample(source=inner.text("from"), numbers={w: n for w, n in numbers.items() if n is not None})


def _files(root: Section) -> tuple[Part, ...]:
    parts: list[Part] = []
    for section in _list(root, "files"):
        section.only(("name", "sample", "constants", "columns", "read", "drop"))
        name = section.text("name")
        if not name or "/" in name or "\\" in name or name in (".", ".."):
            section.say(f"is {name!r}: give the name of a file in the folder", "name")
        part = Part(
            name=name,
            sample=_sample(section),
            constants=constants_of(section.section("constants")),
            columns=columns_of(section.section("columns")),
            reading=_reading(section.section("read")) if "read" in section else None,
            drop=_conditions(section, "drop"),
        )
        if name in [other.name for other in parts]:
            section.say(f"names {name} a second time: name each file once")
        parts.append(part)
    return tuple(parts)


def _samples(section: Section) -> dict[int, Mapping[str, float]]:
    for key, _ in section.items():
        if not key.isdigit():
            section.say("is no number of a sample", key)
    return {int(key): constants_of(section.section(key)) for key, _ in section.items() if key.isdigit()}


def _members(root: Section) -> tuple[Member, ...]:
    members = []
    for section in _list(root, "members"):
        section.only(("pressure", *DESIGN))
        design = Section({k: v for k, v in section.items() if k in DESIGN}, section.place, root.mistakes)
        if "pressure" not in section:
            section.say("has no pressure: add pressure: {from: …, unit: …}")
        pressure = column_of(section.section("pressure"), "pressure_kpa") if "pressure" in section else Column("")
        members.append(Member(pressure, constants_of(design)))
    return tuple(members)


def _list(section: Section, key: str) -> Sequence[Section]:
    value = section.content.get(key)
    if value is None:
        return []
    if not isinstance(value, list) or not value:
        section.say("is no list: begin each entry with -", key)
        return []
    return [Section(one, f"{section.at(key)}[{i}]", section.mistakes) for i, one in enumerate(value, start=1)]


def _conditions(root: Section, key: str) -> tuple[Condition, ...]:
    value = root.content.get(key)
    if isinstance(value, Mapping):
        return (condition_of(root.section(key)),)
    return tuple(condition_of(section) for section in _list(root, key))


def _plateaus(section: Section) -> Plateaus:
    section.only(("of", "settle", "least"))
    of = _tolerances(section.section("of"))
    if not of:
        section.say("says of no column: add of: {pressure_kpa: 1} with how far it may wander on a plateau")
    least = section.integer("least", 2)
    return Plateaus(of, section.integer("settle", 0) or 0, 5 if least is None else least)


def _tolerances(section: Section) -> dict[str, float]:
    tolerances = {}
    for name, _ in section.items():
        value = section.number(name)
        if name not in QUANTITIES and not name.startswith("pressure_"):
            section.only(QUANTITIES, "column of the table")
        elif value is not None and value <= 0:
            section.say(f"is {value:g}: give a positive number", name)
        elif value is not None:
            tolerances[name] = value
    return tolerances


def _rest(root: Section) -> Condition | Literal["first"] | None:
    if root.content.get("rest") == "first":
        return "first"
    return condition_of(root.section("rest")) if "rest" in root else None


def _steps(root: Section) -> Steps:
    value = root.content.get("step")
    if isinstance(value, Mapping):
        inner = root.section("step")
        inner.only(("from", "state", "new_state_on"))
        if "from" in inner:
            return Steps("column", inner.text("from"))
        state = inner.texts("state")
        if unknown := [name for name in state if name not in QUANTITIES]:
            inner.say(f"names {unknown[0]}: name columns of the table, such as twist_deg", "state")
        return Steps("derive", state=state, anew=inner.texts("new_state_on"))
    return Steps("each_row" if root.choice("step", ("derive", "each_row"), "derive") == "each_row" else "derive")
