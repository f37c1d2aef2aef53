"""A study from the page: every model on every training set, and heat maps of their errors on every test set."""

from __future__ import annotations

from pathlib import Path

import panel as pn

from freelearn.common.errors import UserError
from freelearn.workbench.panels.python_lines import python_lines
from freelearn.workbench.panels.widgets import Part, heading, say, words
from freelearn.workbench.state.own_code import models
from freelearn.workbench.state.session import Session

ABOUT = (
    "Every model that is ticked is fitted to every training set, of the data, effects and choices on the left, and "
    "tested on every test set: the paper's heat maps. Linear and continuum models take about a second a fit, networks "
    "many times as long. What was fitted once is taken from there again."
)
FIRST = ("linear", "continuum")


class Studying(Part):
    """Models and training sets to tick."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.models = pn.widgets.CheckBoxGroup(name="models", options=models(), value=list(FIRST), inline=True)
        self.trains = pn.widgets.CheckBoxGroup(name="training sets", options=[], value=[], inline=True)
        self.go = pn.widgets.Button(name="Run the study", button_type="primary", width=220)
        self.go.on_click(lambda _: self.asked())
        self.wrong, self.lines = words(), words()
        self.view = pn.Column(
            heading("Run a study"), words(ABOUT), heading("Models", 3), self.models, heading("Training sets", 3),
            self.trains, self.go, self.wrong, self.lines, sizing_mode="stretch_width",
        )  # fmt: skip

    def asked(self) -> None:
        """Runs it."""
        wrong = [] if self.models.value and self.trains.value else ["Tick a model and a training set at least."]
        wrong = wrong or self._impossible()
        say(self.wrong, wrong, "bad")
        if not wrong:
            self.session.study(self.models.value, self.trains.value)

    def _impossible(self) -> list[str]:
        """Why models that are ticked cannot have the effects that were added."""
        # torch is imported with them: not before somebody asks for a study.
        from freelearn.physics.models.build import build_model

        reasons = []
        for name in self.models.value:
            try:
                build_model(name, effects=self.session.question.effects)
            except UserError as problem:
                reasons.append(f"{problem} Untick one of them.")
        return reasons

    def refresh(self) -> None:
        """Shows the session as it is."""
        sets, busy = self.session.sets, self.session.busy
        if self.trains.options != sets:
            with self.shown():
                self.trains.param.update(options=sets, value=list(sets))
        self.go.disabled = busy or not self.session.ready
        latest = self.session.asides.get("study")
        say(self.wrong, self.session.failure("study"), "bad")
        asked = latest["question"] if latest else None
        lines = [asked.command("study"), "\n".join(python_lines(asked, "study"))] if asked else []
        say(self.lines, lines, code=True)

    @property
    def latest(self) -> Path | None:
        """The table of the study that was run last."""
        done = self.session.asides.get("study")
        path = self.session.folder / done["folder"] / "heatmap.csv" if done else None
        return path if path and path.exists() else None
