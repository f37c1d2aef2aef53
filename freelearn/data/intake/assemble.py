"""The rows of all files as the table of the contract, its members, and where it all came from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.common.package import VERSION
from freelearn.data.beds import BEDS
from freelearn.data.columns import pressure_column
from freelearn.data.flicker import stood
from freelearn.data.intake.evaluate import ANEW, FILE, LINE
from freelearn.data.intake.plateaus import COUNT
from freelearn.data.intake.recipes.recipe import DESIGN, MARKS, QUANTITIES, Recipe
from freelearn.data.intake.recipes.recipe_file import needed
from freelearn.data.logs import RUN

# What a table has beyond quantities: states that its rows share, and the count of steps in them.


def shared_values(values: np.ndarray, tolerance: float, column: str) -> np.ndarray:
    """Values with those that lie within the tolerance of each other replaced by their mean, (N,).

    A bed that returns to a place is not quite there. Raises UserError where values form a chain, each near the next:
    then there are no places.

    >>> shared_values(np.array([0.1, 5.0, -0.1, 5.2]), 0.5, "elongation_mm").round(2).tolist()
    [0.0, 5.1, 0.0, 5.1]
    """
    levels, place = np.unique(values, return_inverse=True)
    group = np.concatenate([[0], np.cumsum(np.diff(levels) > tolerance)])
    width = pd.Series(levels).groupby(group).agg(lambda part: part.max() - part.min())
    if (width > 2 * tolerance).any():
        wide = int(width.to_numpy().argmax())
        low, high = levels[group == wide].min(), levels[group == wide].max()
        raise UserError(
            f"state_tolerance.{column} = {tolerance:g} joins all values from {low:.4g} to {high:.4g}: choose "
            "a smaller one."
        )
    means = pd.Series(values).groupby(group[place]).transform("mean")
    return np.asarray(means.round(6))


def count_steps(table: pd.DataFrame, state: list[str]) -> np.ndarray:
    """Steps 0, 1, … of consecutive rows that are alike in the columns `state`, (N,) int64. A place may flicker.

    >>> count_steps(pd.DataFrame({"twist_deg": [0, 0, 5, 0]}), ["twist_deg"]).tolist()
    [0, 1, 0, 0]
    """
    visit = np.r_[0, np.cumsum(~stood(table, state))][: len(table)]
    return np.asarray(table.groupby(visit, sort=False).cumcount(), dtype=np.int64)


# The rows of all files as the table of the contract, with its members and what is told of it.

MOST_SHOWN = 5


@dataclass(frozen=True)
class Intake:
    """table: N rows in the contract's columns. members: of an assembly, else None. lines: (file, line) of each row's
    first reading. files: what became of each file, plain values. warnings: sentences."""

    table: pd.DataFrame
    members: pd.DataFrame | None
    lines: tuple[tuple[str, int], ...]
    files: tuple[Mapping[str, Any], ...]
    warnings: tuple[str, ...]


def assembled(recipe: Recipe, rows: pd.DataFrame, files: Sequence[Mapping[str, Any]], warnings: list[str]) -> Intake:
    """The table of the rows. Raises UserError where an imposed quantity is blank."""
    pressures = [pressure_column(i) for i in range(1, len(recipe.members) + 1)]
    _refuse_blanks(recipe, rows, [*needed(recipe), *pressures])
    for name, tolerance in recipe.state_tolerance.items():
        if name not in rows:
            raise UserError(f"state_tolerance names {name}, which the recipe does not make: name one of its columns.")
        for _, of in rows.groupby("sample", sort=False):
            rows.loc[of.index, name] = shared_values(of[name].to_numpy(), tolerance, name)
    state = recipe.steps.state or tuple(quantity.column for quantity in BEDS[recipe.bed].state)
    anew = [name for name in rows if str(name).startswith(ANEW)]
    if recipe.steps.kind == "derive":
        rows["step"] = count_steps(rows, [FILE, "sample", *state, *anew])
    elif recipe.steps.kind == "each_row":
        rows["step"] = 0
    if "buckled" not in rows:
        rows["buckled"] = 0
    members = _members(recipe)
    names = _order(recipe, rows, pressures)
    lines = tuple((str(file), int(line)) for file, line in zip(rows[FILE], rows[LINE], strict=True))
    return Intake(rows[names].copy(), members, lines, tuple(files), tuple(dict.fromkeys(warnings)))


def _order(recipe: Recipe, rows: pd.DataFrame, pressures: list[str]) -> list[str]:
    """The contract's order, then what readings' averages and the user add."""
    design = [] if recipe.members else list(DESIGN)
    state = ["step", "elongation_mm", "twist_deg", *(pressures or ["pressure_kpa"]), "force_n", "moment_nmm"]
    first = ["sample", *design, *state, *(q for q in QUANTITIES if q not in (*DESIGN, *state)), *MARKS]
    errors = [n for n in rows if "_se_" in str(n)]
    names = [name for name in (*first, RUN, COUNT, *errors, *recipe.carry) if name in rows]
    return list(dict.fromkeys(names))


def _members(recipe: Recipe) -> pd.DataFrame | None:
    if not recipe.members:
        return None
    shared = {name: value for name, value in recipe.constants.items() if name in DESIGN}
    rows = [{"member": i, **shared, **member.constants} for i, member in enumerate(recipe.members, start=1)]
    table = pd.DataFrame(rows)
    return table.reindex(columns=["member", *DESIGN])


def _refuse_blanks(recipe: Recipe, rows: pd.DataFrame, columns: Sequence[str]) -> None:
    problems = []
    for name in columns:
        blank = rows[name].isna()
        if blank.any():
            where = [f"{file} line {line}" for file, line in rows.loc[blank, [FILE, LINE]].head(MOST_SHOWN).to_numpy()]
            more = f" and {blank.sum() - MOST_SHOWN} more" if blank.sum() > MOST_SHOWN else ""
            drop = f" (drop: {{{recipe.columns[name].source}: blank}})" if name in recipe.columns else ""
            problems.append(
                f"{name} is blank in {', '.join(where)}{more}: what the bed imposes must be known: drop these rows"
                f"{drop}, or fill: a number."
            )
    if problems:
        raise UserError("\n  ".join(problems))


# Where a table came from: the raw files, the recipe, and every conversion.


def provenance(
    intake: Intake,
    recipe: Recipe,
    data: Path,
    sources: Mapping[str, bytes],
    recipe_path: Path,
    recipe_text: str,
    designs: Mapping[Path, bytes] | None = None,
) -> dict[str, Any]:
    """Plain values for JSON. data: the file or folder that was taken in. designs: the file of designs, if any."""
    folder = data if data.is_dir() else data.parent
    return {
        "program": f"freelearn {VERSION}",
        "raw": [file_entry(folder / name, content) for name, content in sources.items()],
        "designs": [file_entry(path, content) for path, content in (designs or {}).items()],
        "recipe": {**file_entry(recipe_path, recipe_text.encode()), "content": recipe_text},
        "about": recipe.about,
        "bed": recipe.bed,
        "constants": dict(recipe.constants),
        "samples": {str(number): dict(of) for number, of in recipe.samples.items()},
        "members": [dict(member.constants) for member in recipe.members],
        "plateaus": asdict(recipe.plateaus) if recipe.plateaus else None,
        "state_tolerance": dict(recipe.state_tolerance),
        "rows": len(intake.table),
        "files": [dict(file) for file in intake.files],
        "warnings": list(intake.warnings),
    }


def file_entry(path: Path, content: bytes) -> dict[str, str]:
    """What a provenance says of a file."""
    return {"path": str(path), "sha256": hashlib.sha256(content).hexdigest()}
