"""Designs by actuator: a second file, or a sheet of the workbook, joined with the rows by the actuators' names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.intake.evaluate import Evaluation
from freelearn.measurements.intake.raw_file import raw_table
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.recipe import Design, Recipe, Sample


def with_designs(recipe: Recipe, sources: Mapping[str, bytes], content: bytes | None = None) -> Recipe:
    """The recipe with the constants of each actuator in place of its `design`. content: of the file of designs; None
    where they are a sheet of the only source. Raises UserError where a design is blank, twice there, or nobody's."""
    design = recipe.design
    if design is None:
        return recipe
    name = design.file or next(iter(sources))
    content = content if content is not None else sources.get(name)
    if content is None:
        raise UserError(f"The file of designs {name} was not given: add design={name} to intake.")
    raw = raw_table(content, name, Reading(sheet=design.sheet or None))
    words = raw.text(design.by)
    raw = raw.rows([row for row, word in enumerate(words) if word])
    words = [word for word in words if word]
    for word in words:
        if words.count(word) > 1:
            raise UserError(
                f"{name}: {word!r} stands {words.count(word)} times in {design.by!r}: keep one row of each."
            )
    numbers = _numbers(recipe, words, name)
    made = _constants(design, raw)
    samples = {
        number: {**recipe.samples.get(number, {}), **{column: float(values[row]) for column, values in made.items()}}
        for row, word in enumerate(words)
        if (number := numbers.get(word)) is not None
    }
    sample = recipe.sample
    if sample.source is not None and sample.numbers is None and not all(word.isdigit() for word in words):
        sample = Sample(source=sample.source, numbers=numbers)
    return replace(recipe, samples={**recipe.samples, **samples}, sample=sample, design=None)


def _numbers(recipe: Recipe, words: list[str], name: str) -> dict[str, int]:
    """Of each actuator's name its number: the recipe's, else the name where it is one, else its place."""
    if recipe.sample.source is None and not recipe.files:
        raise UserError(
            f"The designs of {name} are joined by the actuators' names: say which column of the data names them, "
            "sample: {from: COLUMN}."
        )
    if recipe.sample.numbers is not None:
        return {word: number for word, number in recipe.sample.numbers.items() if word in words}
    if all(word.removesuffix(".0").isdigit() for word in words):
        return {word: int(float(word)) for word in words}
    return {word: number for number, word in enumerate(words, start=1)}


def _constants(design: Design, raw: RawTable) -> dict[str, np.ndarray]:
    evaluation = Evaluation(raw, dict(design.columns), {}, np.ones(len(raw), dtype=np.int64))
    made = {column: evaluation.quantity(column) for column in design.columns}
    for column, values in made.items():
        blank = np.flatnonzero(np.isnan(values))
        if len(blank):
            raise UserError(f"{raw.name}, line {raw.lines[int(blank[0])]}: {column} is blank: give it.")
    return made
