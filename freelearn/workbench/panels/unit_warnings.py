"""What is said of the data that were given: doubts about units first, then what there is, or what is wrong."""

from __future__ import annotations

from typing import Any

import panel as pn

from freelearn.workbench.panels.widgets import Part, Tick, say, words
from freelearn.workbench.state.question import MUSCLE
from freelearn.workbench.state.session import LARGEST_CSV, MEGABYTE, Session

ACCEPTED = "A measurement table (CSV), or your laboratory's own file: text with columns, Excel (.xlsx), MATLAB (.mat)."
UNITS = "Look at these first. What is computed from a wrong unit means nothing:"
MEASURED = (
    "MEASURED by Martens & Boblan (2017), CC BY 4.0. Its braid angle stands in no data sheet, so fiber_misalignment is "
    "in the model from the start; load cell and gauge were calibrated, so a wrong gain is known to be absent."
)
# In a narrow column long lists of faults are looked through, not read.
SCROLLED = {"max-height": "260px", "overflow-y": "auto"}


class UnitWarnings(Part):
    """Fit waits until the doubts about units are answered: by a yes, or by other units."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        self.units, self.about, self.faults = words(), words(), words()
        self.right = Tick("the units are right as they are", width, self._answered)
        self.faults_view = pn.Column(self.faults, styles=SCROLLED, visible=False)
        self.map = pn.widgets.Button(name="Say what its columns are", visible=False, width=width)
        self.map.on_click(lambda _: self.session.map_columns(True))
        self.view = pn.Column(self.units, self.right.view, self.about, self.faults_view, self.map)

    def _answered(self, right: bool) -> None:
        if not self.refreshing:
            self.session.confirm_units(right)

    def refresh(self) -> None:
        """Shows the session as it is."""
        session, own = self.session, self.session.question.measured
        units = session.unit_warnings if own else []
        lines = [UNITS, *(f"! {warning}" for warning in units)] if units else []
        say(self.units, lines, "bad" if session.doubted else "quiet")
        with self.shown():
            self.right.show(bool(units) and not session.doubted, visible=bool(units), disabled=session.busy)
        if not own:
            say(self.about, ["SIMULATED, not measured"], "source")
        else:
            say(self.about, self._about(), "quiet")
        # While columns are being mapped, what is wrong stands there.
        mapping = session.mapping
        say(self.faults, [] if mapping else session.problem.splitlines(), "bad")
        self.faults_view.visible = bool(session.problem) and not mapping
        # Once intake has made the table, the way back to the columns stands beside it.
        wanted = bool(session.doubted) or not session.table
        self.map.visible = bool(session.raw) and not (mapping or session.made or session.busy) and wanted
        self.map.name = "Say which units they are" if session.doubted else "Say what its columns are"

    def _about(self) -> list[str]:
        question, table = self.session.question, self.session.table
        source = [MEASURED] if question.data == MUSCLE else []
        if table:
            return [*source, _counts(question.name, table), *table.get("warnings", [])]
        return source or [ACCEPTED, f"Up to {LARGEST_CSV // MEGABYTE} MB."]


def _counts(name: str, table: dict[str, Any]) -> str:
    """What table.json says, in words."""
    # A session that was kept before tables had such marks says nothing of them.
    left_out = table.get("left_out", 0)
    parts = [f"{table['rows']} rows"]
    if table["usable"] < table["rows"]:
        parts.append(f"{table['usable']} of them {'usable' if left_out else 'un-buckled'}")
    parts += [f"{left_out} marked to be left out"] if left_out else []
    # A recording is what a kinematic state is elsewhere. A session of former times does not say which they are.
    recordings = table.get("recordings", 0)
    states = _many(recordings, "recording") if recordings else _many(table["states"], "kinematic state")
    parts += [_many(table["samples"], "sample"), states]
    parts += [f"{table['members']} actuators on one end block"] if table.get("members") else []
    return f"{name}: {', '.join(parts)}"


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
