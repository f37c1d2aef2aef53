"""What the search wrote itself, where no effect of the library explains what is missing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import panel as pn

from freelearn.common.errors import UserError
from freelearn.common.formats import sentence
from freelearn.physics.written.written_effect import Written
from freelearn.records.written_effects import PROPOSED, ProposalCurve, proposal_lines
from freelearn.report.html.parity_chart import proposal_chart
from freelearn.workbench.panels.widgets import GOOD, download, heading, say, words
from freelearn.workbench.state.proposed import proposed, written_of
from freelearn.workbench.state.session import Session

# One effect that the search wrote: its sentences, its curve, and what can be done with it.

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
        self.add = pn.widgets.Button(name="Add it", button_type="success", stylesheets=[GOOD], width=BUTTON)
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


WRITTEN, HINTED = "What the search wrote", "A hint at what remains"


class Proposals:
    """A block for each proposal, or one for a hint. Hidden where there is neither."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.shown: Any = None
        self.blocks: list[ProposalBlock] = []
        self.view = pn.Column(visible=False)

    def refresh(self) -> None:
        """Shows the session as it is."""
        search = self.session.discovery() or {}
        # A search of former times knows neither.
        entries, hint = search.get("proposals", []), search.get("hint")
        shown = (self.session.search or {}).get("folder"), entries, hint
        if shown != self.shown:
            self.shown = shown
            self._draw(entries, hint)
        for block in self.blocks:
            block.refresh()

    def _draw(self, entries: list[dict[str, Any]], hint: dict[str, Any] | None) -> None:
        self.blocks = []
        if self.session.search is not None:
            folder = self.session.folder / self.session.search["folder"]
            self.blocks = [ProposalBlock(self.session, folder, entry) for entry in entries]
            if hint and not entries:
                self.blocks = [ProposalBlock(self.session, folder, hint, hint=True)]
        self.view.objects = [heading(WRITTEN if entries else HINTED), *(block.view for block in self.blocks)]
        self.view.visible = bool(self.blocks)
