"""What a laboratory's file leaves open, as fields: what each column is, and what no column says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import panel as pn
from markupsafe import escape

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.guessed import NO, WHAT, YES, Answers, ColumnGuess
from freelearn.data.intake.guesses.meanings import MEANINGS, NOT_USED, UNITS
from freelearn.data.intake.guesses.typed_answers import Question, answer
from freelearn.data.intake.laboratory_units import conversion, dimension, unit_of
from freelearn.workbench.panels.widgets import HIDDEN_LABEL, STYLE, say, words

# One column of a laboratory's file on the page: an example, and what it is.

TOLD: dict[str, str] = {NOT_USED: NOT_USED, **{meaning.words: name for name, meaning in MEANINGS.items()}}
SAY = "say which"
SIGNS = {"as it is": NO, "turned": YES}
# Of a load it is never taken for granted, but for a column with the table's own name.
SIGNS_OF_LOADS = {
    "force_n": {SAY: "", "a push is positive": NO, "a pull is positive": YES},
    "moment_nmm": {SAY: "", "falls when turned": NO, "rises when turned": YES},
}


class ColumnRow:
    """guess: of the column. rivaled: whether others say the same, so that what it is has to be said. changed: called
    when something else is chosen."""

    def __init__(self, guess: ColumnGuess, rivaled: bool, changed: Callable[[], None]) -> None:
        self.guess, name = guess, guess.name
        self.about = pn.pane.HTML(_about(guess), stylesheets=[STYLE], width=330, margin=(4, 10))
        hidden = {"stylesheets": [HIDDEN_LABEL]}
        meaning = "" if rivaled else guess.quantity if guess.chosen and guess.quantity else NOT_USED
        told = {SAY: "", **TOLD} if rivaled else TOLD
        self.quantity = pn.widgets.Select(name=f"what {name} is", options=told, value=meaning, width=170, **hidden)
        self.unit = pn.widgets.Select(name=f"unit of {name}", options=[], width=100, **hidden)
        self.turned = pn.widgets.Select(name=f"sign of {name}", options=SIGNS, value=NO, width=150, **hidden)
        self.offset = pn.widgets.FloatInput(name=f"offset of {name}", value=0.0, width=130, **hidden)
        self.quantity.param.watch(lambda _: self._chosen(changed), "value")
        self.unit.param.watch(lambda _: changed(), "value")
        self._units()

    @property
    def cells(self) -> list[Any]:
        """What stands in the row."""
        return [self.about, self.quantity, self.unit, self.turned, self.offset]

    @property
    def answers(self) -> Answers:
        """What the row says; nothing of a unit or a sign that is still to be chosen."""
        name = self.guess.name
        said: dict[str, str | float] = {WHAT + name: self.quantity.value or NOT_USED}
        if self.quantity.value in ("", NOT_USED):
            return said
        said |= {f"unit.{name}": self.unit.value} if self.unit.value not in (None, SAY) else {}
        said |= {f"sign.{name}": self.turned.value} if self.turned.value else {}
        return said | ({f"offset.{name}": float(self.offset.value)} if self.offset.value else {})

    def _chosen(self, changed: Callable[[], None]) -> None:
        self._units()
        changed()

    def _units(self) -> None:
        meaning = MEANINGS.get(self.quantity.value)
        kind = meaning.kind if meaning else ""
        options, written = list(UNITS.get(kind, ())), self.guess.unit
        # A ratio may go without a unit; what else has none is asked for.
        value = None if not options else options[0] if kind == "ratio" else SAY
        if kind and written and dimension(written) == kind:
            value = next((option for option in options if _same(written, option)), written)
            options += [] if value in options else [written]
        elif kind and kind != "ratio":
            options = [SAY, *options]
        self.unit.param.update(options=options, value=value)
        signs = SIGNS if self.quantity.value == self.guess.name else SIGNS_OF_LOADS.get(self.quantity.value, SIGNS)
        if self.turned.options != signs:
            self.turned.param.update(options=signs, value=next(iter(signs.values())))
        for cell in (self.unit, self.turned, self.offset):
            cell.disabled = not kind


def _same(written: str, unit: str) -> bool:
    """Whether two spellings are one unit."""
    change = conversion(written, unit)
    return abs(change.factor - 1) < 1e-9 and abs(change.shift) < 1e-9


def _about(guess: ColumnGuess) -> str:
    """The column's name with its range or words, and what is not sure. Everything from the file is escaped."""
    if guess.numeric:
        shown = f"{guess.low:.4g} … {guess.high:.4g}, first {_short(guess.example)}"
    else:
        shown = ", ".join(guess.words[:4]) or guess.example or "blank"
    doubts = []
    if guess.chosen and MEANINGS[guess.quantity or ""].kind not in ("", "ratio"):
        doubts += [] if guess.unit else ["the heading says no unit"]
    if guess.chosen and guess.confidence != "sure":
        doubts.append(f"{guess.confidence}: check")
    doubt = f'<span class="bad"> {escape("; ".join(doubts))}</span>' if doubts else ""
    return f'<p><b>{escape(guess.name)}</b>{doubt}<br><span class="quiet">{escape(shown[:60])}</span></p>'


def _short(example: str) -> str:
    """A number with as many digits as one looks at; one with a decimal comma, say, as it is written."""
    try:
        return f"{float(example):.6g}"
    except ValueError:
        return example


# What a laboratory's file does not say, as fields: the same questions as `freelearn start` asks.

WIDTH = 440


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
