"""What there is to see once something is fitted: what came out, whether it stands, comparison, suspected readings, what
the search wrote, effects."""

from __future__ import annotations

import panel as pn

from freelearn.workbench.claim import Claim
from freelearn.workbench.comparison import Comparison
from freelearn.workbench.effects import Effects
from freelearn.workbench.fitted import written
from freelearn.workbench.outcome import Outcome
from freelearn.workbench.proposals import Proposals
from freelearn.workbench.session import Session
from freelearn.workbench.suspects import Suspects


class Results:
    """The main part of the page."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.outcome, self.comparison = Outcome(session), Comparison(session)
        self.claim = Claim(session)
        self.effects, self.suspects, self.proposals = Effects(session), Suspects(session), Proposals(session)
        self.drawn: list[tuple[str, float]] = []
        parts = (self.outcome, self.claim, self.comparison, self.suspects, self.proposals, self.effects)
        self.view = pn.Column(*(part.view for part in parts), sizing_mode="stretch_width")

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
