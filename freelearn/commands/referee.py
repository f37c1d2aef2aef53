"""`referee`: whether what a run claims stands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from freelearn.commands.parse import parsed
from freelearn.commands.referee_settings import RefereeSettings
from freelearn.commands.small_app import small_app

if TYPE_CHECKING:
    from freelearn.results.refereed_run import RefereedRun


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
        from freelearn.commands.referee_run import refereed_run
        from freelearn.render.terminal.refereed import show_refereed
    with LongWork(console, "asking whether the claim stands…"):
        done = refereed_run(settings)
    show_refereed(console, done)


def referee(
    run: str | Path,
    referee: Literal["standing", "simulate"] = "standing",
    tables: int = 40,
    *,
    cores: int | None = None,
    seed: int = 0,
) -> RefereedRun:
    """The checks of what a run of discover or train claims, in the folder `run`, whose referee.json is written anew.

    referee: simulate also searches so many tables, simulated from the run's models. Raises UserError.

    freelearn.referee("outputs/discover/…").checks are the checks.
    """
    from freelearn.commands.referee_run import refereed_run

    settings = {"run": str(run), "referee": referee, "tables": tables, "cores": cores, "seed": seed}
    return refereed_run(parsed(RefereeSettings, settings))
