"""The files that are taken in: one, or those of a folder."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from freelearn.errors import UserError
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.text_file import read_bytes

ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".ods", ".mat", ".h5", ".hdf5", ".parquet")


def is_folder(path: Path) -> bool:
    """Whether there is a folder of that name; of names that no file can have, there is none."""
    try:
        return path.is_dir()
    except OSError:
        return False


def read_sources(data: Path, recipe: Recipe) -> dict[str, bytes]:
    """Name → bytes of the file, or of the files in the folder that the recipe lists. Raises UserError."""
    if not recipe.files:
        if is_folder(data):
            raise UserError(f"{data} is a folder: name one file in it, or list its files in the recipe under files:.")
        return {data.name: read_bytes(data)}
    folder = data if is_folder(data) else data.parent
    if not is_folder(data) and [part.name for part in recipe.files] != [data.name]:
        raise UserError(f"The recipe lists several files, and {data} is one: give their folder as data.path.")
    there = [path.name for path in _inside(folder)]
    lacking = [part.name for part in recipe.files if part.name not in there]
    if lacking:
        near = get_close_matches(lacking[0], there, n=1)
        hint = f": did you mean {near[0]}?" if near else "."
        raise UserError(f"files of the recipe names {lacking[0]}, which is not in {folder}{hint}")
    return {part.name: read_bytes(folder / part.name) for part in recipe.files}


def table_files(folder: Path) -> list[str]:
    """Names of the files in a folder that may hold tables, in order. Raises UserError where there is none."""
    names = sorted(path.name for path in _inside(folder) if path.suffix.lower() in ENDINGS and path.is_file())
    if not names:
        raise UserError(f"{folder} holds no tables ({', '.join(ENDINGS)}): name the file.")
    return names


def _inside(folder: Path) -> list[Path]:
    """What a folder holds. Raises UserError where that cannot be told."""
    try:
        return list(folder.iterdir())
    except (OSError, ValueError) as problem:
        raise UserError(f"{folder} cannot be read: {getattr(problem, 'strerror', None) or problem}.") from None
