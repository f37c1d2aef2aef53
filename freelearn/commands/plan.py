"""`plan`: the rows worth measuring next, or what a plan of the user's own is worth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from freelearn.commands.parse import parsed
from freelearn.commands.plan_settings import PlanSettings
from freelearn.commands.small_app import small_app
from freelearn.errors import UserError
from freelearn.measurements.text_file import missing_file

if TYPE_CHECKING:
    from freelearn.results.plan import Plan


def plan_app() -> None:
    """`plan`, from the words of the command line."""
    small_app("plan", _plan, "there was a plan")


def _plan(content: Any, folder: Path) -> None:
    settings = checked(content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    from freelearn.render.terminal.long_work import LongWork

    console = Console()
    with LongWork(console, "loading torch…"):
        from freelearn.commands.plan_run import planned, write_plan
        from freelearn.render.terminal.plan import show_plan

    with LongWork(console, "planning…"):
        made = planned(settings)
    write_plan(made, folder, settings.figures)
    show_plan(console, made, folder)


def checked(content: Any) -> PlanSettings:
    """Settings from plain values. Raises UserError with every mistake."""
    settings = parsed(PlanSettings, content)
    if settings.plan.path is not None and (problem := missing_file(settings.plan.path)):
        raise UserError(problem)
    return settings


def plan(
    run: str | Path,
    rows: int | None = None,
    goal: Literal["auto", "split", "settle", "halve"] = "auto",
    *,
    effect: str | None = None,
    parameter: str | None = None,
    per_state: int | None = None,
    mounting_rows: float = 1.0,
    reach: dict[str, tuple[float, float]] | None = None,
    path: str | Path | None = None,
    seed: int = 0,
) -> Plan:
    """The next rows worth measuring after a run of discover or train, in the folder `run`; nothing is written.

    Options as those of the command `freelearn plan`; path: a plan of one's own, which is scored. Raises UserError.

    plan("outputs/discover/…", rows=12).table has the rows, in the measurement table's columns.
    """
    from freelearn.commands.plan_run import planned

    own = {"path": None if path is None else str(path)}
    settings: dict[str, Any] = {
        "run": str(run),
        "rows": rows,
        "goal": goal,
        "effect": effect,
        "parameter": parameter,
        "plan": own,
    }
    settings |= {"per_state": per_state, "mounting_rows": float(mounting_rows), "reach": reach or {}, "seed": seed}
    return planned(checked(settings))
