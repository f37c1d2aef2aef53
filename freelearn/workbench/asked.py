"""What a question of the page asks of the commands: settings, as the command line would give them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import CsvData, DataSettings, DiscoverSettings, TrainSettings, VirtualData
from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS, INFLATION
from freelearn.measurements.text_file import missing_file
from freelearn.workbench.question import MUSCLE, OWN, Question


def train_settings(question: Question, fits: Path) -> TrainSettings:
    """A fit's settings. Raises UserError."""
    how = [f"split={question.split}", f"fit={question.fit}", f"seed={question.fit_seed}"]
    chosen = settings(TrainSettings, [f"model={question.model}", *how, *_example(question)])
    return replace(
        chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects,
        per_sample=question.per_sample, fits=fits,
    )  # fmt: skip


def discover_settings(question: Question) -> DiscoverSettings:
    """A search's settings. Raises UserError."""
    how = [f"model={question.model}", f"seed={question.fit_seed}"]
    chosen = settings(DiscoverSettings, [*how, *_example(question)])
    return replace(
        chosen, data=_data(question, chosen.data), train=question.train, effects=question.effects,
        per_sample=question.per_sample, ruled_out=question.ruled_out,
    )  # fmt: skip


def _example(question: Question) -> list[str]:
    """The override by which the measured example is the usual table."""
    return [f"data={MUSCLE}"] if question.data == MUSCLE else []


def _data(question: Question, usual: DataSettings) -> DataSettings:
    if question.data == OWN:
        return _measured(question, usual)
    if question.data == "hidden":
        assert isinstance(usual, VirtualData)
        return replace(usual, hidden="random", seed=question.seed)
    return usual


def _measured(question: Question, usual: DataSettings) -> CsvData:
    paths = [Path(name) for name in (question.path, question.members) if name]
    for path in paths:
        if problem := missing_file(path):
            raise UserError(problem)
    if question.members and BEDS[question.bed] is INFLATION:
        raise UserError("An inflation bed measures the diameter of one actuator: take the file of actuators away.")
    accuracy = None
    if question.accuracy is not None:
        assert usual.accuracy is not None
        accuracy = replace(usual.accuracy, **dict(question.accuracy))
    members = paths[1] if question.members else None
    return CsvData(name="csv", path=paths[0], accuracy=accuracy, bed=question.bed, members=members)
