"""Which actuator each row of a file is of, and what is constant for it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.recipe import Part, Recipe, Sample


def sample_numbers(sample: Sample, raw: RawTable) -> tuple[np.ndarray, dict[str, int]]:
    """The number of each row's actuator, (N,) int64, and the words that were translated. Raises UserError."""
    if sample.source is None:
        return np.full(len(raw), sample.number, dtype=np.int64), {}
    words = raw.text(sample.source)
    if sample.numbers is None:
        values = raw.maybe_numbers(raw.known(sample.source))
        if values is None or np.isnan(values).any() or (values % 1 != 0).any() or (values < 1).any():
            known = ", ".join(f"{w}: {i}" for i, w in enumerate(list(dict.fromkeys(words))[:4], start=1))
            raise UserError(
                f"{raw.name}: column {sample.source!r} holds no numbers of actuators: number its words with "
                f"sample: {{from: {sample.source}, as: {{{known}, …}}}}."
            )
        return values.astype(np.int64), {}
    unknown = sorted({word for word in words if _translated(word, sample.numbers, raw) is None})
    if unknown:
        raise UserError(f"{raw.name}: sample.as has no number for {', '.join(map(repr, unknown[:5]))}: add it.")
    numbers = [_translated(word, sample.numbers, raw) or 0 for word in words]
    return np.array(numbers, dtype=np.int64), dict(sample.numbers)


def _translated(word: str, numbers: Mapping[str, int], raw: RawTable) -> int | None:
    """40 and 40.0 are one word."""
    if word in numbers:
        return numbers[word]
    value = raw.style.number(word)
    return None if value is None or np.isnan(value) else numbers.get(f"{value:g}")


def constants_by_row(recipe: Recipe, part: Part, sample: np.ndarray) -> dict[str, np.ndarray]:
    """Constants for each row, (N,) each: a sample's before a file's before the recipe's. Raises UserError."""
    constants = {name: np.full(len(sample), value) for name, value in recipe.constants_for(part).items()}
    if recipe.samples:
        unknown = sorted(set(sample.tolist()) - set(recipe.samples))
        own = {name for of in recipe.samples.values() for name in of}
        for name in sorted(own):
            values = constants.get(name, np.full(len(sample), np.nan)).copy()
            for number, of in recipe.samples.items():
                if name in of:
                    values[sample == number] = of[name]
            if np.isnan(values).any():
                lacking = unknown or sorted(set(sample[np.isnan(values)].tolist()))
                raise UserError(f"samples of the recipe gives no {name} for sample {lacking[0]}: add it.")
            constants[name] = values
    return constants
