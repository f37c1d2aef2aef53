"""One page: steps on the left, the comparison with the measurements beside them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import panel as pn

from freelearn.common.errors import UserError
from freelearn.workbench.panels.asides import Aside, Planning
from freelearn.workbench.panels.mapping import Made, Mapping
from freelearn.workbench.panels.predicting import Predicting
from freelearn.workbench.panels.rubber_panel import Rubber
from freelearn.workbench.panels.steps import Steps
from freelearn.workbench.panels.sweeps import Sweeps
from freelearn.workbench.panels.widgets import heading, say, words
from freelearn.workbench.state.session import Session

if TYPE_CHECKING:
    from freelearn.workbench.panels.results import Results

log = logging.getLogger(__name__)

# Place of the first tab that is made later.
FIRST_ASIDE = 2
EVERY = 250  # ms between looks at what runs

WELCOME = (
    "Choose data and a model on the left, then press “Fit”: the page shows the model against the measurements at every "
    "kinematic state, and where it is wrong. “Find what is missing” ranks the physical effects that would explain it.",
)


NOTHING = "Fit a model first: then effects can be added by hand, or a search says which are missing."


class Page:
    """What one browser tab shows of a session. Draws anew when the session's version changes, never waits."""

    def __init__(self, session: Session, sweeps: Path) -> None:
        self.session, self.shown = session, -1
        self.steps = Steps(session)
        self.results: Results | None = None
        self.mapping, self.made = Mapping(session), Made(session)
        self.welcome, self.problem = words(), words()
        say(self.welcome, WELCOME, "quiet")
        wide = {"sizing_mode": "stretch_width"}
        self.main = pn.Column(self.problem, self.mapping.view, self.made.view, self.welcome, **wide)
        # Made once the first page is there, which is sooner without them.
        self.later: dict[str, Callable[[], Aside | Rubber | Sweeps]] = {
            "Predict and command": lambda: Predicting(session),
            "Plan": lambda: Planning(session),
            "Rubber": lambda: Rubber(session),
            "Study": lambda: Sweeps(sweeps, session),
        }
        self.asides: dict[str, Aside | Rubber | Sweeps] = {}
        self.places = {name: pn.Column(**wide) for name in self.later}
        self.nothing = words(NOTHING)
        self.missing = pn.Column(self.nothing, **wide)
        self.tabs = pn.Tabs(
            ("Compare", self.main),
            ("What is missing", self.missing),
            *self.places.items(),
            **wide,
        )
        self.tabs.param.watch(self._turned, "active")
        self.view = pn.Column(
            heading("freelearn workbench", 1),
            pn.Row(self.steps.view, self.tabs, **wide),
            **wide,
        )
        self.look()
        pn.state.onload(self._make_asides)
        pn.state.add_periodic_callback(self.look, period=EVERY)

    def look(self) -> None:
        """Draws what has changed."""
        self.session.poll()
        if self.shown == self.session.version:
            return
        self.shown = self.session.version
        self.steps.refresh()
        self.mapping.refresh()
        self.made.refresh()
        say(self.problem, [])
        try:
            self._show()
            for aside in self.asides.values():
                aside.refresh()
        except Exception as problem:
            # Such as a run's folder that somebody has removed meanwhile: the page says so and goes on.
            log.error("a run cannot be shown: %s", problem, exc_info=not isinstance(problem, (OSError, UserError)))
            say(self.problem, [f"This cannot be shown: {type(problem).__name__}: {problem}"], "bad")

    def _show(self) -> None:
        fitted = bool(self.session.comparable())
        self.welcome.visible = not (fitted or self.session.mapping)
        self.nothing.visible = not fitted
        if self.results is not None:
            # Of other data than those that are chosen now.
            self.results.view.visible = self.results.missing.visible = fitted
        if not fitted:
            return
        if self.results is None:
            # torch and matplotlib take seconds to import: not before there is something to show.
            from freelearn.workbench.panels.results import Results

            self.results = Results(self.session)
            self.results.refresh()
            self.main.append(self.results.view)
            self.missing.append(self.results.missing)
        else:
            self.results.refresh()

    def _make_asides(self) -> None:
        for name, make in self.later.items():
            self.asides[name] = aside = make()
            self.places[name].append(aside.view)
        self.later = {}
        self.shown = -1
        self.look()

    def _turned(self, event: Any) -> None:
        shown = [*self.asides.values()][event.new - FIRST_ASIDE] if self.asides and event.new >= FIRST_ASIDE else None
        if isinstance(shown, Sweeps):
            shown.look()
