"""The first step on the left: which data, of which bed, of how many actuators, and how well they were measured."""

from __future__ import annotations

from io import StringIO
from typing import Any

import panel as pn

from freelearn.data.accuracy import PAPER
from freelearn.data.beds import BEDS, INFLATION, Quantity
from freelearn.data.intake.template import members_template, template
from freelearn.workbench.panels.unit_warnings import UnitWarnings
from freelearn.workbench.panels.widgets import Dropper, Part, download, say, words
from freelearn.workbench.state.question import DATA, OWN, Stated
from freelearn.workbench.state.session import Session

# How well the user's bed measures.

USUAL, ESTIMATE, STATE = "as the paper's bed", "estimate it from the data", "state it"
QUANTITIES = {q.column: q for bed in BEDS.values() for q in (*bed.imposed, *bed.measured)}
# What may be exact: all but the readings of a load cell or a camera.
MAY_BE_EXACT = ("elongation_mm", "twist_deg", "pressure_kpa")
SMALLEST = 1e-9


class AccuracyChoice(Part):
    """An estimate, the paper's, or one standard deviation of each quantity of the bed."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        options = [ESTIMATE, USUAL, STATE]
        self.how = pn.widgets.Select(name="accuracy of the measuring", options=options, width=width)
        self.numbers = {name: _number(quantity, width) for name, quantity in QUANTITIES.items()}
        self.how.param.watch(lambda _: self._chosen(), "value")
        for widget in self.numbers.values():
            widget.param.watch(lambda _: self._chosen(), "value")
        self.view = pn.Column(self.how, *self.numbers.values())

    def _chosen(self) -> None:
        if not self.refreshing:
            self.session.choose(accuracy=self._stated())

    def _stated(self) -> Stated:
        if self.how.value == ESTIMATE:
            return None
        if self.how.value == USUAL:
            return ()
        shown = _of_bed(self.session.question.bed)
        given = {name: widget.value for name, widget in self.numbers.items() if name in shown}
        return tuple((name, float(value)) for name, value in given.items() if value is not None)

    def refresh(self) -> None:
        """Shows the session as it is."""
        question, busy = self.session.question, self.session.busy
        stated = question.accuracy
        shown = _of_bed(question.bed) if stated else set()
        with self.shown():
            how = ESTIMATE if stated is None else STATE if stated else USUAL
            self.how.param.update(value=how, disabled=busy)
            known: dict[str, Any] = {name: _usual(q) for name, q in QUANTITIES.items()} | dict(stated or ())
            for name, widget in self.numbers.items():
                widget.param.update(value=known[name], visible=name in shown, disabled=busy)
        self.view.visible = question.data == OWN


def _number(quantity: Quantity, width: int) -> pn.widgets.FloatInput:
    name, least = f"σ of {quantity.name} [{quantity.unit}]", 0.0 if quantity.column in MAY_BE_EXACT else SMALLEST
    return pn.widgets.FloatInput(name=name, value=_usual(quantity), start=least, width=width)


def _usual(quantity: Quantity) -> float:
    """The paper's, in the unit of the column."""
    return float(f"{getattr(PAPER, quantity.error) / quantity.factor:.6g}")


def _of_bed(name: str) -> set[str]:
    return {quantity.column for quantity in (*BEDS[name].imposed, *BEDS[name].measured)}


# How many actuators share an end block, and the file of their designs.

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


SEVERAL = "Recordings or channels in files of their own: drop all of them together, or a .zip of their folders."

# The first step on the left: which data, of which bed, and how well they were measured.


class Given(Part):
    """Data, bed, files, accuracy."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        wide = {"width": width}
        self.data = pn.widgets.Select(name="data", options={text: key for key, text in DATA.items()}, **wide)
        self.seed = pn.widgets.IntInput(name="which hidden effect (a seed)", start=0, end=10**6, step=1, **wide)
        self.bed = pn.widgets.Select(name="bed", options=list(BEDS), **wide)
        self.imposed = words()
        self.block = EndBlock(session, width)
        self.file = Dropper(width, self.session.upload, self.session.upload_several)
        self.several = words(SEVERAL)
        self.template = download("Empty template of the table", width, content=self._template)
        self.doubts, self.accuracy = UnitWarnings(session, width), AccuracyChoice(session, width)
        for widget, name in ((self.data, "data"), (self.seed, "seed"), (self.bed, "bed")):
            widget.param.watch(lambda event, name=name: self.chosen(name, event.new), "value")
        self.view = pn.Column(
            self.data, self.seed, self.file, self.several, self.doubts.view, self.bed, self.imposed, self.block.view,
            self.template, self.accuracy.view,
        )  # fmt: skip

    def _template(self) -> StringIO:
        count = self.block.count
        return StringIO(template(self.session.question.bed, count if count > 1 else 0))

    def refresh(self) -> None:
        """Shows the session as it is."""
        with self.shown():
            self._refresh()

    def _refresh(self) -> None:
        question, busy = self.session.question, self.session.busy
        own = question.data == OWN
        # While columns are being mapped, the bed is asked for there.
        asked = own and not self.session.mapping
        self.data.param.update(value=question.data, disabled=busy)
        self.seed.param.update(value=question.seed, visible=question.data == "hidden", disabled=busy)
        self.file.param.update(visible=own, disabled=busy)
        self.several.visible = own and not self.session.raw and not question.path
        self.doubts.refresh()
        self.bed.param.update(value=question.bed, visible=asked, disabled=busy)
        self.imposed.visible = asked or (question.measured and not own)
        say(self.imposed, [_imposed(question.bed)], "quiet")
        self.block.refresh(asked)
        self.template.param.update(visible=asked, filename=f"{question.bed}_table.csv")
        self.accuracy.refresh()


def _imposed(bed: str) -> str:
    imposed, measured = (
        ", ".join(quantity.name for quantity in part) for part in (BEDS[bed].imposed, BEDS[bed].measured)
    )
    return f"imposed: {imposed}; measured: {measured}"
