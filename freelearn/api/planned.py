"""A plan of what to measure next, as a notebook shows it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from html import escape
from pathlib import Path

import pandas as pd

from freelearn.api.run_plots import PlanPlots
from freelearn.records.plan_record import Plan


@dataclass(frozen=True)
class Planned(Plan):
    """The rows worth measuring next, with what is expected of them and a certificate."""

    @classmethod
    def from_plan(cls, plan: Plan) -> Planned:
        """The same plan."""
        return cls(**{field.name: getattr(plan, field.name) for field in fields(Plan)})

    @cached_property
    def plot(self) -> PlanPlots:
        """Its pictures: `plot.places()`."""
        return PlanPlots(self)

    def summary(self) -> str:
        """What is expected, how good that is, and what else to know."""
        return "\n".join([self.says(), self.certificate.sentence(self.visit), *(f"- {note}" for note in self.notes)])

    def frame(self) -> pd.DataFrame:
        """The rows, in the order of measuring, in the measurement table's columns; what is to be measured is blank."""
        return self.table.copy()

    def save(self, folder: str | Path, figures: bool = True) -> Path:
        """Writes plan.csv, plan.json and the picture, as the command does. Raises UserError."""
        from freelearn.api.tasks.plan_task import write_plan

        write_plan(self, Path(folder), figures)
        return Path(folder)

    def __repr__(self) -> str:
        return f"<{self.says()}>"

    def _repr_html_(self) -> str:
        return f"<p>{escape(self.says())}</p>{self.table.head(12).to_html(index=False, border=0, na_rep='')}"
