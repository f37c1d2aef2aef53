"""What there is to see once something is fitted, whether it stands, and which readings are suspected."""

from __future__ import annotations

import panel as pn

from freelearn.records.claims import check_lines, checks_table, models_table, shares_table
from freelearn.records.suspected_readings import SuspectedReading, worst_of_each
from freelearn.workbench.panels.asides import Sides
from freelearn.workbench.panels.comparison import Comparison
from freelearn.workbench.panels.effects_panel import Effects
from freelearn.workbench.panels.outcome import Outcome
from freelearn.workbench.panels.proposals import Proposals
from freelearn.workbench.panels.python_lines import python_lines
from freelearn.workbench.panels.widgets import heading, say, table, words
from freelearn.workbench.state.fitted import written
from freelearn.workbench.state.question import OWN, as_on_the_page
from freelearn.workbench.state.session import Session


class Claim:
    """What stands against the claim in plain sight, everything else folded up."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.against, self.checks, self.models, self.shares = words(), words(), words(), words()
        self.titled = [heading("Sets of effects that fit as well as the best", 3), heading("How probable each is", 3)]
        all_of_it = pn.Card(
            self.checks, self.titled[0], self.models, self.titled[1], self.shares,
            title="Does the claim stand, and what else would fit as well", collapsed=True,
            sizing_mode="stretch_width",
        )  # fmt: skip
        self.view = pn.Column(self.against, all_of_it, sizing_mode="stretch_width", visible=False)

    def refresh(self) -> None:
        """Shows the session as it is."""
        # A search of former times was looked at by no referee.
        search = self.session.discovery() or {}
        checks, shares = search.get("referee", []), shares_table(search.get("shares", {}))
        models = models_table(search.get("models", []))
        say(self.against, [f"• {as_on_the_page(line)}" for line in check_lines(checks)], "bad")
        looked_at = checks_table(checks, asked=search.get("refereed", ()))
        for place, shown in ((self.checks, looked_at), (self.models, models), (self.shares, shares)):
            table(place, shown)
        for title, shown in zip(self.titled, (models, shares), strict=True):
            title.visible = shown is not None
        self.view.visible = bool(checks or models or shares)


# Readings of which the search thinks that they slipped, and which of them to leave out.


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


# What there is to see once something is fitted: what came out, whether it stands, comparison, suspected readings,
# what the search wrote, two fits side by side; and, on a tab of their own, the effects.


class Results:
    """The main part of the page."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.outcome, self.comparison = Outcome(session), Comparison(session)
        self.claim = Claim(session)
        self.effects, self.suspects, self.proposals = Effects(session), Suspects(session), Proposals(session)
        self.drawn: list[tuple[str, float]] = []
        self.sides = Sides(session)
        parts = (self.outcome, self.claim, self.comparison, self.suspects, self.proposals)
        wide = {"sizing_mode": "stretch_width"}
        self.lines, self.missing_lines = words(), words()
        shown = [part.view for part in parts]
        self.view = pn.Column(*shown, self.effects.failures, self.sides.view, self.lines, **wide)
        self.missing = pn.Column(self.effects.view, self.missing_lines, **wide)

    def refresh(self) -> None:
        """Shows the session as it is; there is at least one run."""
        # Reading a run's files takes a moment: only when there is a newer one.
        runs = [(run["folder"], written(self.session.folder / run["folder"])) for run in self.session.comparable()]
        drawn, self.drawn = runs == self.drawn, runs
        self.outcome.refresh(drawn)
        self.claim.refresh()
        if not drawn:
            self.comparison.refresh()
        self.comparison.show_bands()
        self.effects.refresh()
        self.suspects.refresh()
        self.proposals.refresh()
        self.sides.refresh()
        last, search = self.session.comparable()[-1]["question"], self.session.search
        asked = search["question"] if search else last
        for place, question, kind in ((self.lines, last, "train"), (self.missing_lines, asked, "discover")):
            say(place, [question.command(kind), "\n".join(python_lines(question, kind))], code=True)
