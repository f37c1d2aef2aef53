"""Two fits side by side: parameters, errors on the same rows, and a page with their curves."""

from __future__ import annotations

from pathlib import Path

import panel as pn

from freelearn.workbench.panels.asides import Aside
from freelearn.workbench.panels.widgets import download, say
from freelearn.workbench.state.session import Session

ABOUT = "compare.txt"


class Sides(Aside):
    """A choice of two of the fits that can be compared."""

    kind, file, title = "compare", "comparison.html", "Two fits side by side"
    first = "There is one fit only: make another, with an effect or with another model."

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Set them side by side")
        self.one = pn.widgets.Select(name="A", options={}, width=340)
        self.other = pn.widgets.Select(name="B", options={}, width=340)
        self.asking.objects = [pn.FlexBox(self.one, self.other)]
        self.save = download("Page with curves", 220, self.file)
        self.view[-2] = self.save

    @property
    def possible(self) -> bool:
        """Whether there are two."""
        return len(self.session.same_table()) > 1

    def refresh(self) -> None:
        """Shows the session as it is."""
        runs = self.session.same_table()
        options = {f"{place}  {_words(run['question'])}": run["folder"] for place, run in enumerate(runs, start=1)}
        for choice, place in ((self.one, 0), (self.other, -1)):
            kept = choice.value if choice.value in options.values() else None
            # The latest stands beside the first until somebody chooses otherwise.
            kept = None if choice is self.other and kept == self.one.value else kept
            choice.param.update(options=options, value=kept or (list(options.values())[place] if options else None))
        self.view.visible = bool(runs)
        super().refresh()

    def asked(self) -> None:
        """Compares the two."""
        if self.one.value == self.other.value:
            say(self.wrong, ["A and B are the same fit: choose another."], "bad")
            return
        self.session.set_beside(self.one.value, self.other.value)

    def _show(self, run: str, folder: Path) -> None:
        text, page = folder / ABOUT, folder / self.file
        if not (text.exists() and page.exists()):
            say(self.said, [f"{page} is gone: ask again."], "bad")
            return
        say(self.said, [])
        lines = text.read_text(encoding="utf-8").splitlines()
        say(
            self.answer,
            ["\n".join(line.rstrip() for line in lines if not line.startswith("page: ")).strip()],
            code=True,
        )
        self.save.param.update(file=str(page), visible=True)


def _words(question: object) -> str:
    model, effects, train = (getattr(question, name) for name in ("model", "effects", "train"))
    return f"{' + '.join([model, *effects])}, on {train}"
