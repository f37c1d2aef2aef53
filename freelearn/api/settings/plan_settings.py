"""What `plan` was asked to do, checked once and frozen. As light to import as the settings of the other commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator
from pydantic.dataclasses import dataclass

from freelearn.api.settings.parse import parsed
from freelearn.api.settings.predict_settings import RunPath
from freelearn.api.settings.settings import STRICT, Deviation, OptionalPath, Seed, Switch, is_number
from freelearn.errors import UserError
from freelearn.measurements.text_file import missing_file


def _limits(value: Any) -> Any:
    """{column: [lowest, highest]}."""
    entries = value or {}
    if isinstance(entries, Mapping) and all(
        isinstance(ends, list | tuple) and len(ends) == 2 and all(map(is_number, ends)) and ends[0] <= ends[1]
        for ends in entries.values()
    ):
        return {str(name): (float(ends[0]), float(ends[1])) for name, ends in entries.items()}
    raise ValueError("give {column: [lowest, highest]}, for example reach={elongation_mm:[-5,5]}")


# Readings of one plan: it is chosen visit by visit, and more than a day's tell little more than twice the half of them.
MOST_ROWS = 1000
Count = Annotated[int, Field(strict=True, ge=1, le=MOST_ROWS)]


@dataclass(frozen=True, config=STRICT)
class OwnPlan:
    """A plan of the user's own, to be scored."""

    path: OptionalPath = None


@dataclass(frozen=True, config=STRICT)
class PlanSettings:
    """What one plan does. run: the folder of a run. rows: how many, None with a plan of one's own. goal: auto splits a
    class where there is one, else halves the widest interval. per_state: rows of each mounting; None: the best for what
    a mounting costs, mounting_rows rows. reach: of the bed, by column, where it is not what the table went to."""

    run: RunPath
    rows: Count | None = None
    goal: Literal["auto", "split", "settle", "halve"] = "auto"
    effect: str | None = None
    parameter: str | None = None
    per_state: Count | None = None
    mounting_rows: Deviation = 1.0
    reach: Annotated[dict[str, tuple[float, float]], PlainValidator(_limits)] = field(default_factory=dict)
    plan: OwnPlan = OwnPlan()
    seed: Seed = 0
    figures: Switch = True

    def __post_init__(self) -> None:
        for goal, name in (("settle", "effect"), ("halve", "parameter")):
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
