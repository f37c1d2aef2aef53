"""A laboratory's file that asks something of a fit: what its columns are, and what else is to be said of it."""

from __future__ import annotations

from typing import Any

import panel as pn

from freelearn.measurements.intake.guess import with_meanings
from freelearn.measurements.intake.guess_plain import Guessed
from freelearn.measurements.intake.guessed import Guess
from freelearn.measurements.intake.meanings import MEANINGS
from freelearn.measurements.intake.questions import meaning_of, said
from freelearn.measurements.intake.wanted import Actuators, wanted_draft, wanted_questions
from freelearn.workbench.open_questions import OpenQuestions
from freelearn.workbench.session import Session
from freelearn.workbench.tick import Tick
from freelearn.workbench.words import say, words


class AskedFile:
    """Hidden until a file was read that is no table of questions itself."""

    def __init__(self, session: Session) -> None:
        self.session = session
        # The job that read the file, and what it found.
        self.of = ""
        self.guessed: Guessed | None = None
        self.known = Actuators({1: {}}, 0, {})
        self.about, self.wrong = words(), words()
        self.all = Tick("change what the columns are", 300, lambda _: self._offer())
        self.questions = OpenQuestions(self._offer)
        self.go = pn.widgets.Button(name="Answer the file", button_type="primary", width=220)
        self.go.on_click(lambda _: self._answer())
        self.view = pn.Column(
            self.about, self.all.view, self.questions.view, self.wrong, self.go, visible=False,
            sizing_mode="stretch_width",
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows what was read last; a table of questions is answered at once."""
        latest = self.session.asides.get("asks")
        folder = latest["folder"] if latest else ""
        self.go.disabled = self.session.busy
        if folder == self.of:
            return
        self.of = folder
        content = self.session.read(latest, "asks.json") if latest else None
        self.guessed = None
        if latest and content and content["table"]:
            self.session.ask("predict", asks=latest["question"].asks)
        elif content:
            self._read(content)
        self.view.visible = self.guessed is not None

    def _read(self, content: dict[str, Any]) -> None:
        self.guessed = Guessed.from_plain(content["guessed"])
        known = content["known"]
        designs = {int(number): dict(design) for number, design in known["designs"].items()}
        self.known = Actuators(designs, int(known["members"]), dict(known["held"]))
        found = self.guessed.found
        lines = [f"{found.name}: {found.rows} rows that ask something of the latest fit."]
        for column in found.columns:
            what = MEANINGS[column.quantity].words if column.chosen and column.quantity else "not used"
            lines.append(f"{column.name}: {what}{f' [{column.unit}]' if column.unit and column.chosen else ''}")
        say(self.about, [*lines, *(f"! {note}" for note in found.notes)])
        self._offer()

    def _found(self, answers: dict[str, str | float]) -> Guess:
        assert self.guessed is not None
        return with_meanings(self.guessed.found, said(self.guessed.found, answers))

    def _offer(self) -> None:
        """Asks what is open; an answer may bring a question."""
        if self.guessed is None:
            return
        for _ in range(2):
            answers = self.questions.answers({})[0]
            asked = {q.key: q for q in wanted_questions(self._found(answers), self.known, answers)}
            if self.all.ticked:
                columns = {q.key: q for q in map(meaning_of, self.guessed.found.columns)}
                asked = columns | {key: question for key, question in asked.items() if key not in columns}
            self.questions.ask(list(asked.values()))

    def _answer(self) -> None:
        given, wrong = self.questions.answers({})
        say(self.wrong, wrong, "bad")
        latest = self.session.asides.get("asks")
        if wrong or latest is None:
            return
        recipe = self.session.stored(wanted_draft(self._found(given), self.known, given).encode(), "recipe", ".yaml")
        question = latest["question"]
        self.session.ask("predict", asks=question.asks, name=question.name, recipe=recipe)
