"""`intake`: a laboratory's raw file becomes a measurement table, or a recipe to edit."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.settings import IntakeSettings
from freelearn.api.tasks.intake import taken_in
from freelearn.api.tasks.intake_files import PROVENANCE, beside
from freelearn.commands.command_line import program
from freelearn.commands.small_app import small_app
from freelearn.files import remove_unfinished, write_text
from freelearn.measurements.intake.draft import draft
from freelearn.measurements.intake.joined import guess_file
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.intake.sources import is_folder, table_files
from freelearn.render.terminal.intake import show_guess, show_intake


def intake_app() -> None:
    """`intake`, from the words of the command line."""
    small_app("intake", _intake, "the table was written")


def _intake(content: Any, folder: Path) -> None:
    take_in(parsed(IntakeSettings, content), folder, Console())


def take_in(settings: IntakeSettings, folder: Path, console: Console) -> None:
    """Writes the table and its provenance, or without a recipe the draft of one to `folder`. Raises UserError."""
    if settings.recipe is None:
        _draft(settings, folder, console)
    else:
        _table(settings, settings.recipe, folder, console)


def _draft(settings: IntakeSettings, folder: Path, console: Console) -> None:
    data = settings.data.path
    files = table_files(data) if is_folder(data) else []
    found, joined = guess_file(data / files[0] if files else data, settings.design)
    path = folder / f"{_stem(data)}_recipe.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    remove_unfinished(folder)
    write_text(path, draft(found, files, joined))
    words = [_option("data.path", data), _option("recipe", path)]
    # What was asked for this time is asked for the next time, too.
    words += [_option(name, value) for name in ("out", "design") if (value := getattr(settings, name)) is not None]
    command = _command([*program("intake"), *words])
    show_guess(console, found, path, command)


def _table(settings: IntakeSettings, recipe_path: Path, folder: Path, console: Console) -> None:
    data = settings.data.path
    made = taken_in(data, recipe_path, settings.out or folder / f"{_stem(data)}_table.csv", settings.design)
    members = [] if made.members is None else [made.members]
    files = [made.path, *members, beside(made.path, PROVENANCE)]
    show_intake(console, made.intake, files, _next(made.recipe, made.path, members))


def _stem(data: Path) -> str:
    return Path(os.path.abspath(data)).stem


def _next(recipe: Recipe, out: Path, members: Sequence[Path]) -> list[str]:
    """The commands that use the table: to fit it, and to explain it."""
    table = ["data=csv", _option("data.path", out)]
    table += [f"data.bed={recipe.bed}"] if recipe.bed != "kinematic" else []
    table += [_option("data.members", path) for path in members]
    return [_command([*program(name), "train=all", *table]) for name in ("train", "discover")]


def _option(name: str, path: Path) -> str:
    """name=path, with the quotes that Hydra wants round a path of other than plain characters."""
    text = str(path)
    if re.fullmatch(r"[A-Za-z0-9_/.\- ]+", text):
        return f"{name}={text}"
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'{name}="{escaped}"'


def _command(words: Sequence[str]) -> str:
    return " ".join(map(shlex.quote, words))
