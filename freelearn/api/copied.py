"""A run's folder, copied: what marks a whole run comes last."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from freelearn.errors import UserError, cannot_write
from freelearn.files import write_whole
from freelearn.results.run_files import check_folder
from freelearn.results.run_folder import KINDS


def copied(folder: Path, to: Path) -> Path:
    """Copies a run's folder; gives the copy. Raises UserError where a run lies there, or nothing can be written."""
    if to.resolve() == folder.resolve():
        return to
    if any((to / mark).exists() for mark in KINDS):
        raise UserError(f"{to} holds a run already: choose another folder, or delete it.")
    files = sorted((path for path in folder.rglob("*") if path.is_file()), key=lambda path: path.name in KINDS)
    for path in files:
        place = to / path.relative_to(folder)
        check_folder(place.parent)
        try:
            write_whole(place, _copy_of(path))
        except OSError as problem:
            raise cannot_write(place, problem) from None
    return to


def _copy_of(path: Path) -> Callable[[Path], None]:
    def write(beside: Path) -> None:
        shutil.copyfile(path, beside)

    return write
