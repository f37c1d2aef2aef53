"""Columns of a laboratory's file: what intake takes them for, to be changed, and the table that is made of them."""

from __future__ import annotations

from typing import Any

import panel as pn

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.workbench.column_row import ColumnRow
from freelearn.workbench.design_row import DesignRow
from freelearn.workbench.mapped import recipe_of_choices
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading, say, words

# A file with more columns is a log of everything; those that no heading explains are not shown.
MOST_COLUMNS = 40
# With the widths of what stands below them.
HEADINGS = {"column of the file": 330, "what it is": 170, "unit": 100, "sign": 100, "reading at zero": 130}
SIGNS = (
    "A force is positive where the actuator pushes: a muscle's pull is negative. Force and moment are those that the "
    "actuator exerts on its mount: without pressure they fall as it is stretched or turned the positive way."
)


class Mapping:
    """Shown while a file's columns are being mapped."""

    def __init__(self, session: Session) -> None:
        self.session = session
        # Of which file, and what the page itself has to say against what was chosen.
        self.of = self.said = ""
        self.rows: list[ColumnRow] = []
        self.about, self.notes, self.problem = words(), words(), words()
        self.bed = pn.widgets.Select(name="bed of this file", options=list(BEDS), width=180)
        self.bed.param.watch(lambda _: self._offer(), "value")
        self.design = DesignRow()
        self.table = pn.Column()
        self.signs = words()
        say(self.signs, [SIGNS], "quiet")
        self.use = pn.widgets.Button(name="Make the table", button_type="primary", width=180)
        self.drop = pn.widgets.Button(name="Not now", width=120)
        self.use.on_click(lambda _: self._use())
        self.drop.on_click(lambda _: self.session.map_columns(False))
        self.view = pn.Column(
            heading("What are these columns?"), self.about, self.notes, self.bed, self.table, self.signs,
            heading("The same in all rows", 3), self.design.view, self.problem, pn.Row(self.use, self.drop),
            visible=False,
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is. What was chosen stays so until there is another file."""
        raw = self.session.raw
        self.view.visible = self.session.mapping
        if raw and raw["path"] != self.of:
            self.of = raw["path"]
            self._build(raw)
        say(self.problem, [self.said] if self.said else self.session.problem.splitlines(), "bad")
        self.use.disabled = self.drop.disabled = self.session.busy

    def _build(self, raw: dict[str, Any]) -> None:
        guess = raw["guess"]
        columns = sorted(guess["columns"], key=lambda c: not (c["chosen"] or c["quantity"]))[:MOST_COLUMNS]
        columns = [column for column in guess["columns"] if column in columns]
        more = len(guess["columns"]) - len(columns)
        known = "" if guess["nearly"] else " is no measurement table yet"
        text = f"{raw['name']}{known}: {guess['rows']} rows. This is a guess; change what is wrong."
        recipe = "Or drop a recipe (YAML) where you dropped the file."
        say(self.about, [text, recipe, *([f"{more} further columns are not shown."] if more else [])])
        say(self.notes, [f"! {note}" for note in guess["notes"]])
        self.said = ""
        self.rows = [ColumnRow(column, guess["pressures"], self._offer) for column in columns]
        titles = [pn.pane.HTML(f"<b>{title}</b>", width=width, margin=(2, 10)) for title, width in HEADINGS.items()]
        self.table.objects = [pn.Row(*titles), *(pn.Row(*row.cells) for row in self.rows)]
        self.bed.value = guess["bed"]
        self._offer()

    def _offer(self) -> None:
        self.design.offer(self.bed.value, [row.mapped for row in self.rows])

    def _use(self) -> None:
        raw = self.session.raw
        try:
            self.said = ""
            columns = [row.mapped for row in self.rows]
            about = f"columns of {raw['name']}, as said on the page"
            text = recipe_of_choices(self.bed.value, columns, self.design.constants(), self.design.angles(), about)
        except UserError as problem:
            self.said = str(problem)
            self.refresh()
            return
        self.session.take_in(text.encode())
