"""The rows that are worth measuring next."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import panel as pn

from freelearn.workbench.aside import Aside
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words

ABOUT = (
    "The rows that would tell most of what the latest fit left open: those that split effects which look alike, or "
    "else those that halve the widest interval. A fit that a search made tells most."
)
MOST_PLANNED = 500


class Planning(Aside):
    """How many rows there is time for."""

    kind, file, title = "plan", "plan.csv", "What to measure next"

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Choose the rows")
        about = words()
        self.rows = pn.widgets.IntInput(name="rows to measure", value=12, start=1, end=MOST_PLANNED, width=140)
        say(about, [ABOUT], "quiet")
        self.asking.objects = [about, self.rows]

    def asked(self) -> None:
        """Plans so many rows."""
        self.session.ask(self.kind, rows=int(self.rows.value or 1))

    def told(self, folder: Path, answer: pd.DataFrame) -> list[str]:
        """What is expected of the rows, and how good the choice is."""
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        return [str(plan[name]) for name in ("says", "certificate_says") if plan.get(name)]
