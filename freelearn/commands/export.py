"""`export`: a fitted model for other software, with its certificate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from freelearn.api.settings.export_settings import ExportSettings
from freelearn.api.settings.parse import parsed
from freelearn.commands.small_app import small_app

if TYPE_CHECKING:
    from rich.console import Console


def export_app() -> None:
    """`export`, from the words of the command line."""
    small_app("export", _export, "the certificate was written")


def _export(content: Any, folder: Path) -> None:
    settings = parsed(ExportSettings, content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    export(settings, folder, Console())


def export(settings: ExportSettings, folder: Path, console: Console) -> None:
    """Writes the files of the format, export.json and export.html to `folder`. Raises UserError."""
    from freelearn.render.terminal.long_work import LongWork

    with LongWork(console, "loading torch and the model…"):
        from freelearn.api.fitted_run import FittedRun

        fitted = FittedRun.of(settings.run)
    asked = {n: getattr(settings, n) for n in ("name", "sample", "force", "license", "error")}
    with LongWork(console, f"writing to={settings.to}, and running it beside the model…"):
        found = fitted.export(folder, settings.to, **asked)
    console.print(found.summary(), markup=False, highlight=False, soft_wrap=True)
    console.print(f"certificate: {folder / 'export.json'}", markup=False, highlight=False, soft_wrap=True)
