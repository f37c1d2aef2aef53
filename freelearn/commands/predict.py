"""`predict`: what a fitted model answers to a table with blanks."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from freelearn.commands.configuration import CONF
from freelearn.commands.parse import parsed
from freelearn.commands.predict_settings import PredictSettings
from freelearn.errors import UserError
from freelearn.files import remove_empty
from freelearn.measurements.text_file import missing_file

if TYPE_CHECKING:
    from rich.console import Console

ANSWERS, SOLUTIONS = "answers.csv", "solutions.csv"


def predict_app() -> None:
    """`predict`, from the words of the command line."""
    hydra.main(version_base="1.3", config_path=str(CONF), config_name="predict")(_predict)()


def _predict(config: DictConfig) -> None:
    folder = Path(HydraConfig.get().runtime.output_dir)
    try:
        content: Any = OmegaConf.to_container(config, resolve=True)
        settings = parsed(PredictSettings, content)
        if settings.data.path is not None and (problem := missing_file(settings.data.path)):
            raise UserError(problem)
        # After the settings are checked: torch takes seconds to import.
        from rich.console import Console

        predict(settings, folder, Console())
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        sys.exit("error: interrupted before the answers were written.")
    finally:
        remove_empty(folder)


def predict(settings: PredictSettings, folder: Path, console: Console) -> None:
    """Writes answers.csv, solutions.csv where rows have several, and the maps to `folder`. Raises UserError."""
    from freelearn.results.fitted_model import load

    fitted = load(settings.run)
    if settings.data.path is not None:
        _answer(settings, fitted, folder, console)
    if settings.maps:
        from freelearn.commands.maps import write_maps

        for path in write_maps(fitted, folder):
            if path.suffix == ".png":
                console.print(f"map: {path}", markup=False, highlight=False, soft_wrap=True)


def _answer(settings: PredictSettings, fitted: Any, folder: Path, console: Console) -> None:
    from freelearn.csv_text import csv_text
    from freelearn.files import write_text
    from freelearn.measurements.columns import Columns
    from freelearn.measurements.questions import read_questions
    from freelearn.render.terminal.answers import show_answers
    from freelearn.results.run_files import check_folder

    assert settings.data.path is not None
    asked = read_questions(settings.data.path, Columns(fitted.bed, len(fitted.members)))
    with console.status("answering…"):
        answers = fitted.invert(asked.table, bands=settings.bands)
    check_folder(folder)
    # Of an earlier run into the same folder.
    (folder / SOLUTIONS).unlink(missing_ok=True)
    if len(answers.every):
        write_text(folder / SOLUTIONS, csv_text(answers.every, "%.10g"))
    write_text(folder / ANSWERS, csv_text(answers.table(), "%.10g"))
    show_answers(console, answers, fitted, asked.warnings, folder)
