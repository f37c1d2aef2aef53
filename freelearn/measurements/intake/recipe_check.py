"""Whether a recipe gives all that the table of its bed needs."""

from __future__ import annotations

from collections.abc import Iterator

from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.recipe import NEEDED_DESIGN, Part, Recipe


def lacking(recipe: Recipe) -> list[str]:
    """A sentence for each column that the bed needs and the recipe does not give, and for what does not go together."""
    return list(dict.fromkeys([*_columns(recipe), *_members(recipe), *_rest(recipe)]))


def needed(recipe: Recipe) -> tuple[str, ...]:
    """Columns of which no cell may be blank: the design (of members: in their own file) and what the bed imposes."""
    imposed = [quantity.column for quantity in BEDS[recipe.bed].imposed]
    if recipe.members:
        return tuple(name for name in imposed if name != "pressure_kpa")
    return (*NEEDED_DESIGN, *imposed)


def _columns(recipe: Recipe) -> Iterator[str]:
    measured = [quantity.column for quantity in BEDS[recipe.bed].measured]
    for part in recipe.files or (Part(""),):
        where = f" for {part.name}" if part.name else ""
        given = {*recipe.columns_for(part), *recipe.constants_for(part)}
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


def _members(recipe: Recipe) -> Iterator[str]:
    if not recipe.members:
        return
    if "pressure_kpa" in recipe.columns or "pressure_kpa" in recipe.constants:
        yield "pressure_kpa and members exclude each other: give each member its pressure."
    for number, member in enumerate(recipe.members, start=1):
        for name in NEEDED_DESIGN:
            if name not in member.constants and name not in recipe.constants:
                yield f"members[{number}] has no {name}: add it there, or to constants for all."


def _rest(recipe: Recipe) -> Iterator[str]:
    columns = [*recipe.columns.values(), *(c for part in recipe.files for c in part.columns.values())]
    if recipe.rest is None and any(column.offset == "rest" for column in columns):
        yield "an offset is rest, but nothing says which rows are at rest: add rest: first, or rest: {column: value}."
    if recipe.rest is not None and all(column.offset != "rest" for column in columns):
        yield "rest is given, but no column has offset: rest."
