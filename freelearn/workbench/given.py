"""The first step on the left: which data, of which bed, and how well they were measured."""

from __future__ import annotations

from io import StringIO

import panel as pn

from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.template import template
from freelearn.workbench.accuracy import AccuracyChoice
from freelearn.workbench.controls import Dropper, download
from freelearn.workbench.doubts import Doubts
from freelearn.workbench.end_block import EndBlock
from freelearn.workbench.part import Part
from freelearn.workbench.question import DATA, OWN
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words


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
        self.file = Dropper(width, self.session.upload)
        self.template = download("Empty template of the table", width, content=self._template)
        self.doubts, self.accuracy = Doubts(session, width), AccuracyChoice(session, width)
        for widget, name in ((self.data, "data"), (self.seed, "seed"), (self.bed, "bed")):
            widget.param.watch(lambda event, name=name: self.chosen(name, event.new), "value")
        self.view = pn.Column(
            self.data, self.seed, self.file, self.doubts.view, self.bed, self.imposed, self.block.view, self.template,
            self.accuracy.view,
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
