"""What seldom has to be chosen: how a fit is made, and what it is tested on."""

from __future__ import annotations

import panel as pn

from freelearn.workbench.part import Part
from freelearn.workbench.question import FITS, SPLITS
from freelearn.workbench.session import Session


class Further(Part):
    """Folded up until somebody asks for it."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        inner = width - 20
        self.fit = pn.widgets.Select(name="fitted by", options=_turned(FITS), width=inner)
        self.split = pn.widgets.Select(name="tested on", options=_turned(SPLITS), width=inner)
        self.seed = pn.widgets.IntInput(name="seed of the split and of networks", start=0, end=10**6, width=inner)
        for widget, name in ((self.fit, "fit"), (self.split, "split"), (self.seed, "fit_seed")):
            widget.param.watch(lambda event, name=name: self.chosen(name, event.new), "value")
        self.view = pn.Card(
            self.fit, self.split, self.seed, title="More choices", collapsed=True, width=width, margin=(5, 10)
        )

    def refresh(self) -> None:
        """Shows the session as it is."""
        question, busy = self.session.question, self.session.busy
        with self.shown():
            self.fit.param.update(value=question.fit, disabled=busy)
            self.split.param.update(value=question.split, disabled=busy or self.session.few_states)
            self.seed.param.update(value=question.fit_seed, disabled=busy)


def _turned(options: dict[str, str]) -> dict[str, str]:
    """By what the reader sees."""
    return {text: key for key, text in options.items()}
