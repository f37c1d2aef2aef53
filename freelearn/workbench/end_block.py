"""How many actuators share an end block, and the file of their designs."""

from __future__ import annotations

from io import StringIO

import panel as pn

from freelearn.measurements.beds import BEDS, INFLATION
from freelearn.measurements.intake.template import members_template
from freelearn.workbench.controls import Dropper, download
from freelearn.workbench.part import Part
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words

MOST_ACTUATORS = 16
ASKED = "Drop the file of the actuators' designs (CSV):"
GIVEN = "The file of actuators is there; another one takes its place."


class EndBlock(Part):
    """A number, and for several actuators a place for their file with a template of it."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        # For which file of actuators the number was set.
        self.of = ""
        self.actuators = pn.widgets.IntInput(
            name="actuators on one end block", value=1, start=1, end=MOST_ACTUATORS, width=width
        )
        self.said = words()
        self.file = Dropper(width, lambda name, content: self.session.give_members(content))
        self.template = download("Template of the actuators", width, "members.csv", self._template)
        self.actuators.param.watch(lambda _: self._counted(), "value")
        self.view = pn.Column(self.actuators, self.said, self.file, self.template)

    @property
    def count(self) -> int:
        """How many actuators there are on one end block."""
        return self.actuators.value or 1

    def _template(self) -> StringIO:
        return StringIO(members_template(self.count))

    def _counted(self) -> None:
        if self.refreshing:
            return
        if self.count == 1:
            self.session.choose(members="")
        self.refresh(self.view.visible)

    def refresh(self, visible: bool) -> None:
        """Shows the session as it is."""
        question = self.session.question
        with self.shown():
            self._follow()
        self.view.visible = visible and (BEDS[question.bed] is not INFLATION or bool(question.members))
        self.actuators.disabled = self.session.busy
        several = self.count > 1
        self.file.param.update(visible=several, disabled=self.session.busy)
        self.said.visible = self.template.visible = several
        say(self.said, [GIVEN if question.members else ASKED], "quiet")

    def _follow(self) -> None:
        """As many as the table has, once it was read with a file of actuators."""
        question, several = self.session.question, self.session.table.get("members", 0)
        if question.members and several and question.members != self.of:
            self.of, self.actuators.value = question.members, several
        elif self.of and not question.members:
            self.of, self.actuators.value = "", 1
