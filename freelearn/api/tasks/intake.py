"""A laboratory's raw file, by a recipe, to a measurement table with its provenance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from freelearn.api.tasks.intake_files import beside, check_out, write_intake
from freelearn.errors import UserError
from freelearn.measurements.intake.assemble import Intake
from freelearn.measurements.intake.convert import convert
from freelearn.measurements.intake.provenance import provenance
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.intake.recipe_file import recipe_of, recipe_text
from freelearn.measurements.intake.sources import is_folder, read_sources
from freelearn.measurements.text_file import read_bytes


@dataclass(frozen=True)
class TakenIn:
    """path: of the table. members: of its actuators' file, None for one alone. intake: with all that is to be said."""

    path: Path
    recipe: Recipe
    members: Path | None
    intake: Intake

    @property
    def bed(self) -> str:
        """What the table's bed is called."""
        return self.recipe.bed


def taken_in(data: Path, recipe_path: Path, out: Path, design: Path | None = None) -> TakenIn:
    """Writes the table that a recipe makes of a file or a folder, and beside it its provenance and its members. design:
    the file of the actuators' designs, where it does not lie beside the data. Raises UserError."""
    text = recipe_text(recipe_path)
    recipe = recipe_of(text, str(recipe_path))
    sources = read_sources(data, recipe)
    designs = _designs(recipe, data, design)
    check_out(out, [recipe_path, data, *(data / name for name in sources), *designs])
    intake = convert(recipe, sources, next(iter(designs.values()), None))
    made = provenance(intake, recipe, data, sources, recipe_path, text, designs)
    warnings = write_intake(intake, recipe, out, made)
    members = beside(out, "_members.csv") if recipe.members else None
    said = tuple(dict.fromkeys([*intake.warnings, *warnings]))
    return TakenIn(out, recipe, members, replace(intake, warnings=said))


def _designs(recipe: Recipe, data: Path, given: Path | None) -> dict[Path, bytes]:
    """The file of designs, {} where there is none. Raises UserError."""
    if recipe.design is None:
        if given is not None:
            raise UserError(
                f"design={given} is given, but the recipe joins no designs: add design: {{file: {given.name}, "
                "by: COLUMN, columns: {…}} to it."
            )
        return {}
    if not recipe.design.file and given is None:
        return {}
    path = given or (data if is_folder(data) else data.parent) / recipe.design.file
    return {path: read_bytes(path)}
