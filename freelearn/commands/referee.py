"""`referee`: whether what a run claims stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.referee_settings import RefereeSettings
from freelearn.commands.small_app import small_app


def referee_app() -> None:
    """`referee`, from the words of the command line."""
    small_app("referee", _referee, "the checks were done")


def _referee(content: Any, folder: Path) -> None:
    settings = parsed(RefereeSettings, content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    from freelearn.render.terminal.long_work import LongWork

    console = Console()
    with LongWork(console, "loading torch…"):
        from freelearn.api.tasks.referee_run import refereed_run
        from freelearn.render.terminal.refereed import show_refereed
    with LongWork(console, "asking whether the claim stands…"):
        done = refereed_run(settings)
    show_refereed(console, done)
