"""What a laboratory's file does not say, as fields: the same questions as `freelearn start` asks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import panel as pn

from freelearn.errors import UserError
from freelearn.measurements.intake.draft import Answers
from freelearn.measurements.intake.questions import Question, answer
from freelearn.measurements.intake.units import unit_of
from freelearn.workbench.words import HIDDEN_LABEL, say, words

WIDTH = 440
SAY = "say which"


class OpenQuestions:
    """A field for each question. changed: called when an answer is given."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self.changed = changed
        self.asked: dict[str, Question] = {}
        self.fields: dict[str, Any] = {}
        # A question that comes again finds its answer.
        self.kept: dict[str, str | None] = {}
        self.places: dict[str, pn.Column] = {}
        self.view = pn.FlexBox(align_items="flex-start")

    def ask(self, questions: Sequence[Question]) -> None:
        """Shows these questions, in their order."""
        self.kept |= {key: field.value for key, field in self.fields.items()}
        for question in questions:
            if self.asked.get(question.key) != question:
                self._build(question, self.kept.get(question.key))
        self.asked = {question.key: question for question in questions}
        self.fields = {key: self.fields[key] for key in self.asked}
        self.places = {key: self.places[key] for key in self.asked}
        places = list(self.places.values())
        if self.view.objects != places:
            self.view.objects = places

    def _build(self, question: Question, value: str | None) -> None:
        text, hidden = words(), {"stylesheets": [HIDDEN_LABEL], "width": WIDTH - 20}
        unit = unit_of(question.column).replace("*", "·") if question.kind in ("number", "given") else ""
        say(text, [question.text + (f" [{unit}]" if unit else "")])
        told = words()
        say(told, [question.told] if question.told else [], "quiet")
        if question.kind == "choice":
            options = {**({} if question.proposed else {SAY: ""}), **{told: name for name, told in question.options}}
            known = value if value in options.values() else question.proposed or ""
            field: Any = pn.widgets.Select(name=question.text, options=options, value=known, **hidden)
        else:
            shown = f"{question.proposed:g}" if isinstance(question.proposed, float) else str(question.proposed or "")
            field = pn.widgets.TextInput(
                name=question.text, value=value or shown, placeholder=HINTS[question.kind], **hidden
            )
        field.param.watch(lambda _: self.changed(), "value")
        self.fields[question.key] = field
        self.places[question.key] = pn.Column(
            text, field, *([told] if question.told else []), width=WIDTH, margin=(2, 6)
        )

    def answers(self, known: Answers) -> tuple[dict[str, str | float], list[str]]:
        """What was answered, and what is still to be said of the others. known: answers given elsewhere."""
        given: dict[str, str | float] = {}
        wrong = []
        for key, question in self.asked.items():
            typed = str(self.fields[key].value or "").strip()
            if not typed:
                wrong.append(f"{question.short or question.text}: still to be said.")
                continue
            try:
                given[key] = answer(question, typed, {**known, **given})
            except UserError as mistake:
                wrong.append(f"{question.short or question.text}: {mistake}")
        return given, wrong


HINTS = {
    "number": "a number, also with its unit: 3.5 in",
    "given": "a number, or ? to be answered",
    "unit": "such as mm, kPa, N, deg",
}
