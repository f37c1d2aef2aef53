"""Raw files of tests of rubber alone, by a recipe, to a table of specimen tests with its provenance."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from freelearn.api.tasks.intake_task import PROVENANCE, beside, check_out
from freelearn.common.csv_text import csv_text
from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import read_bytes, write_text
from freelearn.common.package import VERSION
from freelearn.data.intake.assemble import file_entry
from freelearn.data.intake.readers.raw_files import is_folder
from freelearn.data.intake.recipes.recipe_file import content_of, recipe_text
from freelearn.data.intake.rubber.rubber_convert import RubberIntake, convert_tests
from freelearn.data.intake.rubber.rubber_recipe import RubberTest, is_rubber, parse_tests


@dataclass(frozen=True)
class RubberTaken:
    """path: of the table, which `specimens` reads. intake: with all that is to be said."""

    path: Path
    intake: RubberIntake


def is_rubber_recipe(path: Path) -> bool:
    """Whether a recipe is of tests of rubber. Raises UserError where it is none at all."""
    return is_rubber(content_of(recipe_text(path), str(path)))


def rubber_taken_in(files: Sequence[Path] | Mapping[str, Path], recipe_path: Path, out: Path) -> RubberTaken:
    """Writes the table that a recipe makes of files, or of those in a folder, and beside it its provenance. files: of
    those that lie under other names than the recipe's, by its names. Raises UserError."""
    text = recipe_text(recipe_path)
    tests = parse_tests(content_of(text, str(recipe_path)), str(recipe_path))
    paths = _paths(files, tests)
    check_out(out, [recipe_path, *paths.values()])
    sources = {name: read_bytes(path) for name, path in paths.items()}
    made = convert_tests(tests, sources)
    told = {
        "program": f"freelearn {VERSION}",
        "raw": [file_entry(paths[name], content) for name, content in sources.items()],
        "recipe": {**file_entry(recipe_path, text.encode()), "content": text},
        "rows": len(made.table),
        "tests": list(made.records),
        "warnings": list(made.warnings),
    }
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_text(beside(out, PROVENANCE), json.dumps(told, indent=1, ensure_ascii=False) + "\n")
        write_text(out, csv_text(made.table))
    except OSError as problem:
        raise cannot_write(out, problem, "choose another place with out=FILE") from None
    return RubberTaken(out, made)


def _paths(files: Sequence[Path] | Mapping[str, Path], tests: Sequence[RubberTest]) -> Mapping[str, Path]:
    """Name → path of each file that the recipe needs."""
    if isinstance(files, Mapping):
        return files
    if len(files) == 1 and is_folder(files[0]):
        return {test.file: files[0] / test.file for test in tests if test.file}
    return {path.name: path for path in files}


def same_names(files: Sequence[Path]) -> None:
    """Raises UserError where two files have one name, by which a recipe would call both."""
    names = [path.name for path in files]
    if twice := {name for name in names if names.count(name) > 1}:
        raise UserError(f"Two of the files are called {twice.pop()}: rename one.")
