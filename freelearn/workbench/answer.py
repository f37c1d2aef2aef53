"""The sealed answer of a simulated bed with a hidden effect."""

from __future__ import annotations

import panel as pn

from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words


class Answer:
    """A button that opens what was hidden, once a search has said what it thinks."""

    def __init__(self, session: Session) -> None:
        self.session, self.opened = session, ""
        self.open = pn.widgets.Button(name="Open the sealed answer", width=260)
        self.told = words()
        self.open.on_click(lambda _: self._open())
        self.view = pn.Column(self.open, self.told, visible=False)

    def refresh(self) -> None:
        """Shows the session as it is. What was opened is closed again for another search."""
        folder = self.session.search["folder"] if self.session.search else ""
        hidden = self.session.question.data == "hidden" and self.session.discovery() is not None
        self.view.visible = hidden
        self.open.visible = folder != self.opened
        if self.open.visible:
            say(self.told, [])

    def _open(self) -> None:
        assert self.session.search is not None
        self.opened = self.session.search["folder"]
        answer = self.session.read(self.session.search, "sealed_answer.json") or {}
        parts = [
            f"{name} ({', '.join(f'{key} = {value:.3g}' for key, value in values.items())})" if values else name
            for name, values in answer.get("hidden", {}).items()
        ]
        say(self.told, [f"Hidden was: {'; '.join(parts) or 'nothing'}. Values in SI units."], "quiet")
        self.open.visible = False
