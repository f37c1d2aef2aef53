"""`predict`: what a fitted model answers to a table with blanks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.predict_settings import PredictSettings
from freelearn.commands.command_line import command_line, program
from freelearn.commands.small_app import small_app
from freelearn.errors import UserError
from freelearn.measurements.text_file import missing_file

if TYPE_CHECKING:
    from rich.console import Console

    from freelearn.results.answers import Answers


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
    from freelearn.render.terminal.long_work import LongWork

    with LongWork(console, "loading torch and the model…"):
        from freelearn.api.fitted_run import FittedRun

        fitted = FittedRun.of(settings.run)
    if settings.data.path is not None:
        _answer(settings, fitted, folder, console)
    if settings.maps:
        from freelearn.commands.maps import write_maps

        for path in write_maps(fitted, folder):
            if path.suffix == ".png":
                console.print(f"map: {path}", markup=False, highlight=False, soft_wrap=True)


def draw_answers(answers: Answers, folder: Path) -> None:
    """Writes answers.png, where there are enough to see something in it."""
    from freelearn.render.png.answers import answers_figure
    from freelearn.render.png.canvas import save_picture

    figure = answers_figure(answers)
    if figure is not None:
        save_picture(figure, answers.filled, folder / "answers.png")


def _answer(settings: PredictSettings, fitted: Any, folder: Path, console: Console) -> None:
    from freelearn.measurements.questions import read_questions
    from freelearn.render.terminal.answers import show_answers
    from freelearn.render.terminal.long_work import LongWork

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
        answers = fitted.invert(asked.table, bands=settings.bands)
    answers.save(folder)
    draw_answers(answers, folder)
    show_answers(console, answers, fitted, asked.warnings, folder)
