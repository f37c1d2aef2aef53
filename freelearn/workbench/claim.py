"""How sure what the search claims is: the referee's checks, sets of effects that are as good, and shares."""

from __future__ import annotations

import panel as pn

from freelearn.results.claim_tables import check_lines, checks_table, models_table, shares_table
from freelearn.workbench.phrases import as_on_the_page
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading, say, table, words


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
        for place, shown in ((self.checks, checks_table(checks)), (self.models, models), (self.shares, shares)):
            table(place, shown)
        for title, shown in zip(self.titled, (models, shares), strict=True):
            title.visible = shown is not None
        self.view.visible = bool(checks or models or shares)
