"""Reading a recipe (YAML): plain values only, each key once; nothing in it is executed."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

import yaml

from freelearn.common.errors import UserError
from freelearn.common.files import read_text
from freelearn.data.beds import BEDS
from freelearn.data.intake.recipes.recipe import (
    MARKS,
    NEEDED_DESIGN,
    QUANTITIES,
    Condition,
    Part,
    Plateaus,
    Recipe,
    Recordings,
    Sample,
    Steps,
)
from freelearn.data.intake.recipes.recipe_columns import columns_of, condition_of, conditions_of, constants_of
from freelearn.data.intake.recipes.recipe_parts import (
    design_of,
    files_of,
    joins_of,
    members_of,
    reading_of,
    sample_of,
    samples_of,
)
from freelearn.data.intake.recipes.recipe_section import Section, refuse_mistakes

# Whether a recipe gives all that the table of its bed needs.


def lacking(recipe: Recipe) -> list[str]:
    """A sentence for each column that the bed needs and the recipe does not give, and for what does not go together."""
    if mistakes := list(_beside(recipe)):
        return mistakes
    return list(dict.fromkeys([*_columns(recipe), *_members(recipe), *_rest_needed(recipe), *_log(recipe)]))


def needed(recipe: Recipe) -> tuple[str, ...]:
    """Columns of which no cell may be blank: the design (of members: in their own file) and what the bed imposes."""
    imposed = [quantity.column for quantity in BEDS[recipe.bed].imposed]
    if recipe.members:
        return tuple(name for name in imposed if name != "pressure_kpa")
    return (*NEEDED_DESIGN, *imposed)


def _columns(recipe: Recipe) -> Iterator[str]:
    measured = [quantity.column for quantity in BEDS[recipe.bed].measured]
    for part in recipe.files or (Part(""),):
        where = f" for {part.label}" if part.label else ""
        joined = [name for join in recipe.joins_for(part) for name in join.columns]
        own = [*recipe.columns_for(part), *recipe.constants_for(part)]
        given = {*own, *joined}
        if joined and "time_s" not in recipe.columns_for(part):
            yield f"join needs the time of the rows{where}: add time_s to columns."
        for name in dict.fromkeys(name for name in joined if [*own, *joined].count(name) > 1):
            yield f"{name} is joined, and given a second time{where}: keep one."
        per_sample = set.intersection(*map(set, recipe.samples.values())) if recipe.samples else set()
        per_sample |= set(recipe.design.columns) if recipe.design else set()
        for name in needed(recipe):
            if name not in given | per_sample:
                place = "constants" if name in NEEDED_DESIGN else "columns or constants"
                yield f"{name} is given nowhere{where}: add it to {place} (a {recipe.bed} bed needs it)."
        if not given & set(measured):
            yield f"nothing measured is given{where}: add {' or '.join(measured)} to columns."
        for name in sorted(set(recipe.columns_for(part)) & set(recipe.constants_for(part))):
            yield f"{name} is both a column and a constant{where}: keep one."


def _beside(recipe: Recipe) -> Iterator[str]:
    for part in recipe.files:
        if part.beside and (part.join or len(part.beside) != len(recipe.join)):
            yield (
                f"beside of {part.label or 'a file'} says where the channels of the recipe's join stand, one for each "
                f"of its {len(recipe.join)}: correct it, or give the file its own join."
            )


def _members(recipe: Recipe) -> Iterator[str]:
    if not recipe.members:
        return
    if "pressure_kpa" in recipe.columns or "pressure_kpa" in recipe.constants:
        yield "pressure_kpa and members exclude each other: give each member its pressure."
    for number, member in enumerate(recipe.members, start=1):
        for name in NEEDED_DESIGN:
            if name not in member.constants and name not in recipe.constants:
                yield f"members[{number}] has no {name}: add it there, or to constants for all."


def _log(recipe: Recipe) -> Iterator[str]:
    if recipe.run is None:
        return
    for part in recipe.files or (Part(""),):
        if "time_s" not in recipe.columns_for(part):
            where = f" for {part.label}" if part.label else ""
            yield f"run makes a log, which needs the time of its rows{where}: add time_s to columns."
    if recipe.plateaus is not None:
        yield "run makes a log of the rows, plateaus averages them: keep one."
    if "run" in recipe.carry:
        yield "carry keeps the column run as the recordings' names, which run tells, too: keep one."


def _rest_needed(recipe: Recipe) -> Iterator[str]:
    columns = [*recipe.columns.values(), *(c for part in recipe.files for c in part.columns.values())]
    if recipe.rest is None and any(column.offset == "rest" for column in columns):
        yield "an offset is rest, but nothing says which rows are at rest: add rest: first, or rest: {column: value}."
    if recipe.rest is not None and all(column.offset != "rest" for column in columns):
        yield "rest is given, but no column has offset: rest."


# From the plain values of a recipe's file to a recipe, or to one error with every mistake in it.

KEYS = (
    *("about", "bed", "read", "files", "join", "sample", "samples", "design", "constants", "columns", "members"),
    *("keep", "drop", "order_by", "plateaus", "rest", "state_tolerance", "step", "run", *MARKS, "carry"),
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
        join=joins_of(root),
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
        run=_recordings(root),
        marks={mark: condition_of(root.section(mark)) for mark in MARKS if mark in root},
        carry=root.texts("carry"),
        about=root.text("about"),
    )
    mistakes += lacking(recipe) if not mistakes else []
    refuse_mistakes(mistakes, name)
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


def _recordings(root: Section) -> Recordings | None:
    value = root.content.get("run")
    if isinstance(value, Mapping):
        inner = root.section("run")
        inner.only(("from",))
        if "from" not in inner:
            inner.say("names no column of the file: add from:")
        return Recordings(inner.text("from"))
    if "run" not in root:
        return None
    root.choice("run", ("derive",), "derive")
    return Recordings()


# A recipe is a page of text.
LARGEST = 200_000


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """Plain values; a key that stands twice and names for repeated parts (& and *) are errors."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for place, (key, (at, _)) in enumerate(zip(keys, node.value, strict=True)):
            if not isinstance(key, Hashable):
                raise yaml.MarkedYAMLError(problem="a key must be a word or a number", problem_mark=at.start_mark)
            if key in keys[:place]:
                raise yaml.MarkedYAMLError(problem=f"key {key!r} stands twice: keep one", problem_mark=at.start_mark)
        return dict(super().construct_mapping(node, deep))

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.MarkedYAMLError(problem="* stands for a part named with &: write it out", problem_mark=mark)
        return super().compose_node(parent, index)


# Dates, times of day such as 12:30 and words such as on or no stay texts: columns are called so. 1e-3 is a number.
_Loader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?\d+", list("-+0123456789")),
    ("float", r"[-+]?(\d+\.\d*|\.\d+|\d+)([eE][-+]?\d+)?|[-+]?\.inf|\.nan", list("-+0123456789.")),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), _first)


def read_recipe(path: str | Path) -> Recipe:
    """The recipe in a file. Raises UserError with every mistake in it."""
    return recipe_of(recipe_text(path), str(path))


def recipe_text(path: str | Path) -> str:
    """A recipe's text. Raises UserError where there is none, or far too much."""
    file = Path(path)
    if file.parent.is_dir() and not file.exists():
        names = [f.name for f in file.parent.iterdir() if f.suffix in (".yaml", ".yml")]
        near = get_close_matches(file.name, names, n=1, cutoff=0.4)
        raise UserError(f"There is no recipe {path}{f': did you mean {near[0]}?' if near else '.'}")
    text = read_text(path)
    if len(text) > LARGEST:
        raise UserError(f"{path} is too long for a recipe: look whether it is the data instead.")
    return text


def recipe_of(text: str, name: str) -> Recipe:
    """The recipe in a text. name: for messages. Raises UserError with every mistake in it."""
    return parse_recipe(content_of(text, name), name)


def content_of(text: str, name: str) -> dict[str, Any]:
    """The plain values in a recipe's text. name: for messages. Raises UserError."""
    try:
        content = yaml.load(text, _Loader)  # A safe loader, with less.
    except yaml.constructor.ConstructorError as problem:
        raise UserError(
            f"{name}{_line(problem)}: {problem.problem}: a recipe holds plain values, no tags (!…)."
        ) from None
    except yaml.MarkedYAMLError as problem:
        raise UserError(f"{name}{_line(problem)}: {problem.problem or 'is no YAML'}.") from None
    except (yaml.YAMLError, RecursionError, ValueError) as problem:
        raise UserError(f"{name} is no YAML: {str(problem).splitlines()[0]}.") from None
    if not isinstance(content, dict):
        raise UserError(f"{name} is no recipe: write bed:, columns: and constants:, or let intake draft one.")
    return content


def _line(problem: yaml.MarkedYAMLError) -> str:
    return f", line {problem.problem_mark.line + 1}" if problem.problem_mark else ""
