"""Readings of which the search thinks that they slipped, and which of them to leave out."""

from __future__ import annotations

import panel as pn

from freelearn.results.suspects import SuspectedReading, worst_of_each
from freelearn.workbench.question import OWN
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading, say, words


class Suspects:
    """A box to tick for each suspected reading, and a search without those that are ticked. Hidden where there are
    none."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.readings: list[SuspectedReading] = []
        self.hint = words()
        self.boxes = pn.widgets.CheckBoxGroup(name="suspected readings", options={}, inline=False)
        self.leave_out = pn.widgets.Button(
            name="Leave these out and search again", button_type="primary", width=260, visible=False
        )
        self.boxes.param.watch(lambda _: self._offer(), "value")
        self.leave_out.on_click(lambda _: self._leave_out())
        self.view = pn.Column(
            heading("Suspected readings"), self.hint, pn.Column(self.boxes, scroll=True, max_height=260),
            self.leave_out, visible=False,
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is. What is ticked stays so until another search says something else."""
        search = self.session.discovery() or {}
        readings = worst_of_each([SuspectedReading.from_plain(entry) for entry in search.get("suspects", [])])
        if readings != self.readings:
            self.readings = readings
            options = {reading.sentence(): number for number, reading in enumerate(readings)}
            self.boxes.param.update(options=options, value=list(options.values()))
        of_a_file = self.session.question.data == OWN
        text = "These may have slipped: the search gave them no weight."
        say(self.hint, [text if of_a_file else f"{text} Only in a file of your own can they be marked."], "quiet")
        self.leave_out.visible = of_a_file
        self.boxes.disabled = self.session.busy or not of_a_file
        self._offer()
        self.view.visible = bool(readings)

    def _offer(self) -> None:
        self.leave_out.disabled = self.session.busy or not self.boxes.value

    def _leave_out(self) -> None:
        self.session.leave_out({line for number in self.boxes.value for line in self.readings[number].lines})
