"""What there is to see once something is fitted: comparison, staircase, effects, suspected readings, what the
search wrote."""

from __future__ import annotations

from typing import Any

import pandas as pd
import panel as pn

from freelearn.render.html.charts.staircase import StaircaseChart
from freelearn.workbench.comparison import Comparison
from freelearn.workbench.effects import Effects
from freelearn.workbench.proposals import Proposals
from freelearn.workbench.session import Session
from freelearn.workbench.suspects import Suspects


class Results:
    """The main part of the page."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.comparison, self.effects, self.suspects = Comparison(session), Effects(session), Suspects(session)
        self.proposals = Proposals(session)
        self.staircase = StaircaseChart(width=316, height=290, what="test error")
        self.drawn: list[tuple[str, float]] = []
        self.view = pn.Column(
            self.comparison.view,
            # Side by side where little is measured; else the maps begin a row of their own.
            pn.FlexBox(
                self.comparison.curves_view, self.comparison.maps_view, pn.pane.Bokeh(self.staircase.panel), gap="0px"
            ),
            self.suspects.view,
            self.proposals.view,
            self.effects.view,
        )

    def refresh(self) -> None:
        """Shows the session as it is; there is at least one run."""
        runs = self.session.comparable()
        # Reading a run's files takes a moment: only when there is a newer one.
        drawn = [(r["folder"], (self.session.folder / r["folder"] / "results.json").stat().st_mtime) for r in runs]
        if drawn != self.drawn:
            self.drawn = drawn
            self.comparison.refresh()
        self.comparison.show_bands()
        self._staircase()
        self.effects.refresh()
        self.suspects.refresh()
        self.proposals.refresh()

    def _staircase(self) -> None:
        rows: list[dict[str, Any]] = []
        before: tuple[str, ...] = ()
        for run in self.session.comparable():
            question = run["question"]
            about = self.session.read(run, "results.json") or {}
            error = about.get("tests", {}).get(question.train, {}).get("E")
            if error is not None:
                step = _changed(before, question.effects)
                floor = about.get("noise_floor", float("nan"))
                rows.append({"step": step, "E_heldout": error, "noise_floor": floor})
            before = question.effects
        if rows:
            self.staircase.show(pd.DataFrame(rows))


def _changed(before: tuple[str, ...], after: tuple[str, ...]) -> str:
    """What a fit has more or less than the one before it, short enough for an axis."""
    added, dropped = [e for e in after if e not in before], [e for e in before if e not in after]
    parts = [
        f"{sign} {names[0] if len(names) == 1 else f'{len(names)} effects'}"
        for sign, names in (("+", added), ("−", dropped))
        if names
    ]
    return " ".join(parts) or "model alone"
