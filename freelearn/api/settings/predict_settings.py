"""What `predict` was asked to do, checked once and frozen. As light to import as the settings of the other commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import PlainValidator
from pydantic.dataclasses import dataclass

from freelearn.api.settings.settings import STRICT, OptionalPath, Switch


def run_folder(value: Any) -> Any:
    """The folder of a run, or what to do where none is named."""
    if value in (None, "", "???"):
        raise ValueError("run is missing: add run=FOLDER, the folder of a run of train or discover")
    return Path(str(value))


RunPath = Annotated[Path, PlainValidator(run_folder)]


@dataclass(frozen=True, config=STRICT)
class QuestionsData:
    """The table of questions."""

    path: OptionalPath = None


@dataclass(frozen=True, config=STRICT)
class PredictSettings:
    """What one run of predict does. bands: whether the answers have 95 % bands. maps: whether pictures are made of what
    can be reached."""

    run: RunPath
    data: QuestionsData = QuestionsData()
    bands: Switch = True
    maps: Switch = False

    def __post_init__(self) -> None:
        if self.data.path is None and not self.maps:
            raise ValueError("predict needs questions: add data.path=QUESTIONS.csv, or maps=true")
