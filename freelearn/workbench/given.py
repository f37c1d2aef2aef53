"""The first step on the left: which data, of which bed, and what looks wrong in them."""

from __future__ import annotations

from io import StringIO
from typing import Any

import panel as pn

from freelearn.measurements.beds import BEDS, INFLATION
from freelearn.measurements.intake.template import members_template, template
from freelearn.workbench.accuracy import AccuracyChoice
from freelearn.workbench.question import DATA
from freelearn.workbench.session import LARGEST_CSV, MEGABYTE, Session
from freelearn.workbench.tick import Tick
from freelearn.workbench.words import say, words

ACCEPTED = "A measurement table (CSV), or your laboratory's own file: text with columns, Excel (.xlsx), MATLAB (.mat)."
UNITS = "Look at these first. What is computed from a wrong unit means nothing:"
MOST_ACTUATORS = 16


class Given:
    """Data, bed, files, accuracy."""

    def __init__(self, session: Session, width: int) -> None:
        self.session, self.refreshing = session, False
        wide = {"width": width}
        self.data = pn.widgets.Select(name="data", options={text: key for key, text in DATA.items()}, **wide)
        self.seed = pn.widgets.IntInput(name="which hidden effect (a seed)", start=0, end=10**6, step=1, **wide)
        self.bed = pn.widgets.Select(name="bed", options=list(BEDS), **wide)
        self.imposed = words()
        self.file = _dropper(width)
        self.actuators = pn.widgets.IntInput(
            name="actuators on one end block", value=1, start=1, end=MOST_ACTUATORS, **wide
        )
        self.members, self.members_said = _dropper(width), words()
        self.template = _template("Empty template of the table", lambda: StringIO(self._template()), width)
        self.members_template = _template(
            "Template of the actuators", lambda: StringIO(members_template(self.count)), width
        )
        self.accuracy = AccuracyChoice(session, width)
        self.doubts, self.about, self.faults = words(), words(), words()
        self.right = Tick("the units are right as they are", width, self._answered)
        self.faults_view = pn.Column(self.faults, scroll=True, max_height=260, visible=False)
        self.map = pn.widgets.Button(name="Say what its columns are", visible=False, **wide)
        self._watch()
        self.view = pn.Column(
            self.data, self.seed, self.bed, self.imposed, self.actuators, self.file, self.members_said, self.members,
            self.doubts, self.right.view, self.about, self.faults_view, self.map, self.template, self.members_template,
            self.accuracy.view,
        )  # fmt: skip

    def _watch(self) -> None:
        for widget, name in ((self.data, "data"), (self.seed, "seed"), (self.bed, "bed")):
            widget.param.watch(lambda event, name=name: self._chosen(name, event.new), "value")
        self.file.param.watch(lambda event: self._dropped(event, self.session.upload), "value")
        members = lambda name, content: self.session.give_members(content)  # noqa: E731
        self.members.param.watch(lambda event: self._dropped(event, members), "value")
        self.actuators.param.watch(lambda _: self._counted(), "value")
        self.map.on_click(lambda _: self.session.map_columns(True))

    def _chosen(self, name: str, value: Any) -> None:
        # What the page itself sets is no choice of the user's.
        if not self.refreshing and value is not None:
            self.session.choose(**{name: value})

    def _answered(self, right: bool) -> None:
        if not self.refreshing:
            self.session.confirm_units(right)

    def _counted(self) -> None:
        if self.refreshing:
            return
        if self.count == 1:
            self.session.choose(members="")
        self.refresh()

    def _dropped(self, event: Any, take: Any) -> None:
        # Of the files dropped so far the latest.
        for name, content in list((event.new or {}).items())[-1:]:
            take(str(name), content.encode() if isinstance(content, str) else content)

    @property
    def count(self) -> int:
        """How many actuators there are on one end block."""
        return self.actuators.value or 1

    def _template(self) -> str:
        return template(self.session.question.bed, self.count if self.count > 1 else 0)

    def refresh(self) -> None:
        """Shows the session as it is."""
        self.refreshing = True
        try:
            self._refresh()
        finally:
            self.refreshing = False

    def _refresh(self) -> None:
        question, busy = self.session.question, self.session.busy
        own = question.data == "csv"
        self.data.param.update(value=question.data, disabled=busy)
        self.seed.param.update(value=question.seed, visible=question.data == "hidden", disabled=busy)
        self.bed.param.update(value=question.bed, visible=own, disabled=busy)
        self.imposed.visible = own
        say(self.imposed, [_imposed(question.bed)], "quiet")
        self.file.param.update(visible=own, disabled=busy)
        self._refresh_members(own, busy)
        self.template.param.update(visible=own, filename=f"{question.bed}_table.csv")
        self.accuracy.refresh()
        self._refresh_words(own)

    def _refresh_members(self, own: bool, busy: bool) -> None:
        question = self.session.question
        may = own and BEDS[question.bed] is not INFLATION
        if question.members and self.count == 1:
            self.actuators.value = max(2, self.session.table.get("members", 2))
        self.actuators.param.update(visible=may or bool(question.members), disabled=busy)
        several = self.actuators.visible and self.count > 1
        self.members.param.update(visible=several, disabled=busy)
        self.members_said.visible = several
        given = "The file of actuators is there; another one takes its place."
        say(
            self.members_said,
            [given if question.members else "Drop the file of the actuators' designs (CSV):"],
            "quiet",
        )
        self.members_template.param.update(visible=several, filename="members.csv")

    def _refresh_words(self, own: bool) -> None:
        session, table = self.session, self.session.table
        units = session.unit_warnings if own else []
        say(self.doubts, [UNITS, *(f"! {warning}" for warning in units)] if units else [], "bad")
        self.right.show(bool(units) and not session.doubted, visible=bool(units), disabled=session.busy)
        if not own:
            say(self.about, ["SIMULATED, not measured"], "source")
        elif table:
            say(self.about, [_about(session.question.name, table), *table.get("warnings", [])], "quiet")
        else:
            say(self.about, [ACCEPTED, f"Up to {LARGEST_CSV // MEGABYTE} MB."], "quiet")
        # While columns are being mapped, what is wrong stands there.
        mapping = bool(session.raw) and session.raw["open"]
        say(self.faults, [] if mapping else session.problem.splitlines(), "bad")
        self.faults_view.visible = bool(session.problem) and not mapping
        self.map.visible = bool(session.raw) and not mapping and not table and not session.busy


def _imposed(bed: str) -> str:
    imposed, measured = (
        ", ".join(quantity.name for quantity in part) for part in (BEDS[bed].imposed, BEDS[bed].measured)
    )
    return f"imposed: {imposed}; measured: {measured}"


def _about(name: str, table: dict[str, Any]) -> str:
    """What table.json says, in words."""
    # A session that was kept before tables had such marks says nothing of them.
    left_out = f", {table['left_out']} marked to be left out" if table.get("left_out") else ""
    usable = f"{table['usable']} of them {'usable' if left_out else 'un-buckled'}"
    several = f", {table['members']} actuators on one end block" if table.get("members") else ""
    return (
        f"{name}: {table['rows']} rows, {usable}{left_out}, {table['samples']} sample(s), "
        f"{table['states']} kinematic states{several}"
    )


def _dropper(width: int) -> pn.widgets.FileDropper:
    # Of any type: browsers know none of MATLAB's, and what cannot be read is refused in words.
    return pn.widgets.FileDropper(
        max_file_size=f"{LARGEST_CSV // MEGABYTE}MB", multiple=False, height=90, width=width, visible=False
    )


def _template(label: str, content: Any, width: int) -> pn.widgets.FileDownload:
    return pn.widgets.FileDownload(
        callback=content, filename="table.csv", label=label, auto=True, embed=False, visible=False, width=width
    )
