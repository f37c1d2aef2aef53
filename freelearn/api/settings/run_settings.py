"""What predict, plan, referee and export were asked to do, checked once and frozen. As light to import as settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator
from pydantic.dataclasses import dataclass

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.settings import (
    STRICT,
    UNNAMED,
    Deviation,
    OptionalPath,
    Seed,
    Share,
    Switch,
    is_number,
    named_path,
)
from freelearn.common.errors import UserError
from freelearn.common.files import missing_file

RunPath = Annotated[Path, named_path("run is missing: add run=FOLDER, the folder of a run of train or discover")]


@dataclass(frozen=True, config=STRICT)
class QuestionsData:
    """The table of questions."""

    path: OptionalPath = None


@dataclass(frozen=True, config=STRICT)
class PredictSettings:
    """What one run of predict does. bands: whether the answers have 95 % bands. average: whether all sets of effects
    answer that a search found as good, and not its last model alone. maps: whether pictures are made of what can be
    reached."""

    run: RunPath
    data: QuestionsData = QuestionsData()
    bands: Switch = True
    average: Switch = False
    maps: Switch = False

    def __post_init__(self) -> None:
        if self.data.path is None and not self.maps:
            raise ValueError("predict needs questions: add data.path=QUESTIONS.csv, or maps=true")


Cores = Annotated[int, Field(strict=True, ge=1)]
# Without and with the last effect: less than one of each tells nothing.
Tables = Annotated[int, Field(strict=True, ge=2)]


@dataclass(frozen=True, config=STRICT)
class RefereeSettings:
    """What one referee does. run: the folder of a run. referee: the standing checks alone, or searches of simulated
    tables too, so many `tables`, on so many `cores`; None: all."""

    run: RunPath
    referee: Literal["standing", "simulate"] = "standing"
    tables: Tables = 40
    cores: Cores | None = None
    seed: Seed = 0


def _told(value: Any) -> Any:
    """A format, or what to do where none is named."""
    if value in UNNAMED:
        raise ValueError("to is missing: add to=onnx, to=c, to=fmu, to=mujoco or to=table")
    return value


Format = Annotated[Literal["onnx", "c", "fmu", "mujoco", "table"], BeforeValidator(_told)]
Sample = Annotated[int, Field(strict=True)]


@dataclass(frozen=True, config=STRICT)
class ExportSettings:
    """What one export does: as export_options.Options, of the run in a folder."""

    run: RunPath
    to: Format
    name: str = "actuator"
    sample: Sample | None = None
    force: Switch = False
    license: str | None = None
    error: Share = 1e-3


def _limits(value: Any) -> Any:
    """{column: [lowest, highest]}."""
    entries = value or {}
    if isinstance(entries, Mapping) and all(
        isinstance(ends, list | tuple) and len(ends) == 2 and all(map(is_number, ends)) and ends[0] <= ends[1]
        for ends in entries.values()
    ):
        return {str(name): (float(ends[0]), float(ends[1])) for name, ends in entries.items()}
    raise ValueError("give {column: [lowest, highest]}, for example reach={elongation_mm:[-5,5]}")


# What goals were called before.
GOALS = {"split": "discriminate", "settle": "detect", "halve": "narrow"}


def _by_old_name(goal: Any) -> Any:
    return GOALS.get(goal, goal) if isinstance(goal, str) else goal


# Readings of one plan: it is chosen visit by visit, and more than a day's tell little more than twice the half of them.
# Of a log they are samples of recordings, and many more.
MOST_ROWS, MOST_SAMPLES = 1000, 100_000
Count = Annotated[int, Field(strict=True, ge=1, le=MOST_SAMPLES)]


@dataclass(frozen=True, config=STRICT)
class OwnPlan:
    """A plan of the user's own, to be scored."""

    path: OptionalPath = None


@dataclass(frozen=True, config=STRICT)
class PlanSettings:
    """What one plan does. run: the folder of a run. rows: how many, None with a plan of one's own. goal: auto
    discriminates the members of a class where there is one, else narrows the widest interval. per_state: rows of each
    mounting; None: the best for what a mounting costs, mounting_rows rows. reach: of the bed, by column, where it is
    not what the table went to."""

    run: RunPath
    rows: Count | None = None
    goal: Annotated[Literal["auto", "discriminate", "detect", "narrow"], BeforeValidator(_by_old_name)] = "auto"
    effect: str | None = None
    parameter: str | None = None
    per_state: Count | None = None
    mounting_rows: Deviation = 1.0
    reach: Annotated[dict[str, tuple[float, float]], PlainValidator(_limits)] = field(default_factory=dict)
    plan: OwnPlan = OwnPlan()
    seed: Seed = 0
    figures: Switch = True

    def __post_init__(self) -> None:
        for goal, name in (("detect", "effect"), ("narrow", "parameter")):
            given = getattr(self, name)
            if self.goal == goal and not given:
                raise ValueError(f"goal={goal} needs to know which: add {name}=NAME")
            if given and self.goal != goal:
                raise ValueError(f"{name}={given} belongs to goal={goal}: add goal={goal}, or leave {name} out")
        if self.rows is None and self.plan.path is None:
            raise ValueError("a plan needs a number of rows: add rows=K, or plan.path=FILE to score a plan of your own")
        if self.rows is not None and self.plan.path is not None:
            raise ValueError("a plan of your own has its rows: leave out rows=, or plan.path=")


def plan_settings(content: Mapping[str, Any]) -> PlanSettings:
    """Settings from plain values. Raises UserError with every mistake."""
    settings = parsed(PlanSettings, content)
    if settings.plan.path is not None and (problem := missing_file(settings.plan.path)):
        raise UserError(problem)
    return settings
