"""One effect that the search wrote: its sentences, its curve, and what can be done with it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import panel as pn

from freelearn.errors import UserError
from freelearn.models.written.written import Written
from freelearn.render.html.charts.proposal import proposal_chart
from freelearn.results.formats import sentence
from freelearn.results.proposal_curve import ProposalCurve
from freelearn.results.proposal_words import proposal_lines
from freelearn.results.proposals import PROPOSED
from freelearn.workbench.controls import download
from freelearn.workbench.proposed import proposed, written_of
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words

NAME = re.compile(r"[a-z0-9_]+")
HINT = "Hint, not a finding: the largest part of it looks like "
ADDED = "It is among the effects below. Where it is ticked, fits and searches have it in the model."
WIDTH, BUTTON = 380, 170


class ProposalBlock:
    """entry: of discovery.json in `folder`. hint: whether it is no finding: then there is nothing to add or to save."""

    def __init__(self, session: Session, folder: Path, entry: Mapping[str, Any], hint: bool = False) -> None:
        self.session = session
        # It becomes part of names of files.
        self.name = str(entry["name"]) if NAME.fullmatch(str(entry["name"])) else ""
        self.path = folder / f"{PROPOSED}_{self.name}.py"
        self.says, self.told, self.problem = words(), words(), words()
        self.add = pn.widgets.Button(name="Add it", button_type="success", width=BUTTON)
        self.save = download("Save the file", BUTTON, self.path.name)
        self.add.on_click(lambda _: self._add())
        self.offered = not hint and self._offered()
        written = written_of(entry)
        if written is not None:
            first, *rest = proposal_lines(entry, written)
            say(self.says, [f"{HINT * hint}{first}.", *map(sentence, rest)])
        chart = self._chart(folder, written)
        left = pn.Column(self.says, pn.FlexBox(self.add, self.save), self.told, self.problem, width=WIDTH)
        # In a row or a column a chart more would have all other charts of the page drawn before their places are known.
        self.view = pn.FlexBox(left, *([chart] if chart else []), gap="0px")
        self.refresh()

    def _offered(self) -> bool:
        """Whether its file is what the search wrote; else that is said."""
        try:
            self.save.file = str(proposed(self.path, self.session.folder).path)
        except UserError as problem:
            say(self.problem, [str(problem)], "bad")
            return False
        return True

    def _chart(self, folder: Path, written: Written | None) -> pn.pane.Bokeh | None:
        """Where the search could tell the function without its form."""
        table = folder / f"proposal_{self.name}.csv"
        if written is None or not table.is_file():
            return None
        curve = ProposalCurve.from_table(written, pd.read_csv(table))
        return pn.pane.Bokeh(proposal_chart(curve)) if curve else None

    def refresh(self) -> None:
        """Shows the session as it is."""
        known = self.session.added.get(self.name, {})
        added = self.offered and known.get("file") == str(self.path.resolve())
        self.add.param.update(visible=self.offered and not added, disabled=self.session.busy)
        self.save.visible = self.offered
        say(self.told, [ADDED] if added else [], "quiet")

    def _add(self) -> None:
        try:
            self.session.add_proposal(self.name)
            say(self.problem, [])
        except UserError as problem:
            say(self.problem, [str(problem)], "bad")
