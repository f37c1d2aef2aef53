"""intake, and what is asked of a run's folder: predict, plan, referee and export."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.run_settings import ExportSettings, PredictSettings, RefereeSettings, plan_settings
from freelearn.api.settings.settings import IntakeSettings
from freelearn.cli.command_line import command_line, program
from freelearn.cli.hydra_app import small_app
from freelearn.common.errors import UserError
from freelearn.common.files import check_there, missing_file

if TYPE_CHECKING:
    from rich.console import Console

    from freelearn.api.fitted_run import FittedRun
    from freelearn.queries.answers import Answers


def intake_app() -> None:
    """`intake`, from the words of the command line."""
    small_app("intake", _intake, "the table was written")


def _intake(content: Any, folder: Path) -> None:
    settings = parsed(IntakeSettings, content)
    check_there(settings.data.path, settings.recipe, settings.design)
    # After the paths are checked: pandas and pint take a second to import.
    from rich.console import Console

    from freelearn.cli.intake_command import take_in

    take_in(settings, folder, Console())


# `predict`: what a fitted model answers to a table with blanks.


def predict_app() -> None:
    """`predict`, from the words of the command line."""
    small_app("predict", _predict, "the answers were written")


def _predict(content: Any, folder: Path) -> None:
    settings = parsed(PredictSettings, content)
    if settings.data.path is not None and (problem := missing_file(settings.data.path)):
        raise UserError(problem)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    predict(settings, folder, Console())


def predict(settings: PredictSettings, folder: Path, console: Console) -> None:
    """Writes answers.csv, solutions.csv where rows have several, and the maps to `folder`. Raises UserError."""
    from freelearn.report.terminal.long_work import LongWork

    with LongWork(console, "loading torch and the model…"):
        from freelearn.api.found import Found
        from freelearn.api.functions import load

        run = load(settings.run)
        fitted = run.fitted if isinstance(run, Found) else run
    ask = fitted.invert
    if settings.average:
        if not isinstance(run, Found):
            raise UserError(f"average=true is asked of a search: {settings.run} holds one model, that of train.")
        ask = partial(run.invert, average=True)
    if settings.data.path is not None:
        _answer(settings, fitted, ask, folder, console)
    if settings.maps:
        from freelearn.cli.map_files import write_maps
        from freelearn.report.terminal.printed_tables import print_line

        for path in write_maps(fitted, folder):
            if path.suffix == ".png":
                print_line(console, f"map: {path}")


def draw_answers(answers: Answers, folder: Path) -> None:
    """Writes answers.png, where there are enough to see something in it."""
    from freelearn.report.plots.answer_plots import answers_figure
    from freelearn.report.plots.canvas import save_picture

    figure = answers_figure(answers)
    if figure is not None:
        save_picture(figure, answers.filled, folder / "answers.png")


def _answer(
    settings: PredictSettings, fitted: FittedRun, ask: Callable[..., Answers], folder: Path, console: Console
) -> None:
    from freelearn.data.table.questions import read_questions
    from freelearn.report.terminal.long_work import LongWork
    from freelearn.report.terminal.printed_run import show_answers

    assert settings.data.path is not None
    try:
        asked = read_questions(settings.data.path, fitted.columns)
    except UserError as mistake:
        words = [str(settings.data.path), "--run", str(settings.run)]
        start = command_line(program("start", ["python", "-m", "freelearn", "start"]), words)
        raise UserError(
            f"{mistake}\nA laboratory's own file asks, once it is said what its columns are, by\n  {start}"
        ) from None
    with LongWork(console, "answering…"):
        answers = ask(asked.table, bands=settings.bands)
    answers.save(folder)
    draw_answers(answers, folder)
    show_answers(console, answers, fitted, asked.warnings, folder)


def plan_app() -> None:
    """`plan`, from the words of the command line."""
    small_app("plan", _plan, "there was a plan")


def _plan(content: Any, folder: Path) -> None:
    settings = plan_settings(content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    from freelearn.report.terminal.long_work import LongWork

    console = Console()
    with LongWork(console, "loading torch…"):
        from freelearn.api.tasks.plan_task import planned, write_plan
        from freelearn.report.terminal.printed_run import show_plan

    with LongWork(console, "planning…"):
        made = planned(settings)
    write_plan(made, folder, settings.figures)
    show_plan(console, made, folder)


def referee_app() -> None:
    """`referee`, from the words of the command line."""
    small_app("referee", _referee, "the checks were done")


def _referee(content: Any, folder: Path) -> None:
    settings = parsed(RefereeSettings, content)
    # After the settings are checked: torch takes seconds to import.
    from rich.console import Console

    from freelearn.report.terminal.long_work import LongWork

    console = Console()
    with LongWork(console, "loading torch…"):
        from freelearn.api.tasks.referee_task import refereed_run
        from freelearn.report.terminal.printed_discovery import show_refereed
    with LongWork(console, "asking whether the claim stands…"):
        done = refereed_run(settings)
    show_refereed(console, done)


# `export`: a fitted model for other software, with its certificate.


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
    from freelearn.report.terminal.long_work import LongWork

    with LongWork(console, "loading torch and the model…"):
        from freelearn.api.fitted_run import FittedRun
        from freelearn.report.terminal.printed_tables import print_line

        fitted = FittedRun.from_folder(settings.run)
    asked = {n: getattr(settings, n) for n in ("name", "sample", "force", "license", "error")}
    with LongWork(console, f"writing to={settings.to}, and running it beside the model…"):
        found = fitted.export(folder, settings.to, **asked)
    print_line(console, found.summary())
    print_line(console, f"certificate: {folder / 'export.json'}")
