"""What a question of the page asks of the commands: settings, as the command line would give them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from freelearn.commands.configuration import settings
from freelearn.commands.settings import CsvData, DataSettings, DiscoverSettings, TrainSettings, VirtualData
from freelearn.errors import UserError
from freelearn.measurements.text_file import missing_file
from freelearn.workbench.question import Question


def train_settings(question: Question, fits: Path) -> TrainSettings:
    """A fit's settings. Raises UserError."""
    chosen = settings(TrainSettings, [f"model={question.model}", "split=states"])
    return replace(chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects, fits=fits)


def discover_settings(question: Question) -> DiscoverSettings:
    """A search's settings. Raises UserError."""
    chosen = settings(DiscoverSettings, [f"model={question.model}"])
    return replace(chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects)


def _data(question: Question, usual: DataSettings) -> DataSettings:
    if question.data == "csv":
        path = Path(question.path)
        if problem := missing_file(path):
            raise UserError(problem)
        return CsvData(name="csv", path=path, accuracy=usual.accuracy)
    assert isinstance(usual, VirtualData)
    return replace(usual, hidden="random", seed=question.seed) if question.data == "hidden" else usual
