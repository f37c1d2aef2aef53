"""The rows of all files as the table of the contract, with its members and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.derive import count_steps, shared_values
from freelearn.measurements.intake.plateaus import COUNT
from freelearn.measurements.intake.quantities import ANEW, FILE, LINE
from freelearn.measurements.intake.recipe import DESIGN, MARKS, QUANTITIES, Recipe
from freelearn.measurements.intake.recipe_check import needed
from freelearn.measurements.members import pressure_column

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
    names = [name for name in (*first, COUNT, *errors, *recipe.carry) if name in rows]
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
