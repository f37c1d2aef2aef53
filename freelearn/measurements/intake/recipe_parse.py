"""From the plain values of a recipe's file to a recipe, or to one error with every mistake in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.recipe import MARKS, QUANTITIES, Condition, Plateaus, Recipe, Sample, Steps
from freelearn.measurements.intake.recipe_check import lacking
from freelearn.measurements.intake.recipe_columns import columns_of
from freelearn.measurements.intake.recipe_conditions import condition_of, conditions_of
from freelearn.measurements.intake.recipe_constants import constants_of
from freelearn.measurements.intake.recipe_parts import (
    design_of,
    files_of,
    members_of,
    reading_of,
    sample_of,
    samples_of,
)
from freelearn.measurements.intake.section import Section

KEYS = (
    *("about", "bed", "read", "files", "sample", "samples", "design", "constants", "columns", "members"),
    *("keep", "drop", "order_by", "plateaus", "rest", "state_tolerance", "step", *MARKS, "carry"),
)


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
        reading=reading_of(root.section("read")),
        files=files_of(root),
        sample=sample_of(root) or Sample(number=1),
        constants=constants_of(root.section("constants")),
        samples=samples_of(root.section("samples")),
        design=design_of(root),
        members=members_of(root),
        keep=condition_of(root.section("keep")) if "keep" in root else None,
        drop=conditions_of(root, "drop"),
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
