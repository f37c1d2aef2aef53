"""`plan`: the rows worth measuring next, or what a plan of the user's own is worth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from freelearn.api.settings.plan_settings import plan_settings
from freelearn.commands.small_app import small_app


def plan_app() -> None:
    """`plan`, from the words of the command line."""
    small_app("plan", _plan, "there was a plan")


def _plan(content: Any, folder: Path) -> None:
    settings = plan_settings(content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    from freelearn.render.terminal.long_work import LongWork

    console = Console()
    with LongWork(console, "loading torch…"):
        from freelearn.api.tasks.plan_run import planned, write_plan
        from freelearn.render.terminal.plan import show_plan

    with LongWork(console, "planning…"):
        made = planned(settings)
    write_plan(made, folder, settings.figures)
    show_plan(console, made, folder)
