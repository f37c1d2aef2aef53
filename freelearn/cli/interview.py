"""Questions about raw files in the terminal, one after the other; any answer can be changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from textwrap import wrap

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.column_questions import meaning_of, said
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.draft_questions import questions
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.guessed import NO, YES, Guess
from freelearn.data.intake.guesses.joined import DesignGuess
from freelearn.data.intake.guesses.typed_answers import Question, answer, in_words
from freelearn.data.intake.guesses.wanted import Actuators, wanted_draft, wanted_questions
from freelearn.data.intake.laboratory_units import unit_of
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.rubber.rubber_guess import RubberGuess
from freelearn.data.intake.rubber.rubber_questions import mode_of, rubber_draft, rubber_questions

# A choice of more has several on a line.
MOST_LINES = 8
# Asks a question and gives what was typed.
Ask = Callable[[str], str]


@dataclass
class Interview:
    """ask: gives what was typed. tell: shows a sentence. answers: by the keys of questions."""

    ask: Ask
    tell: Callable[[str], None]
    answers: dict[str, str | float] = field(default_factory=dict)

    def questions(self) -> Iterator[Question]:
        """All that are to be asked, as far as the answers tell."""
        raise NotImplementedError

    def recipe(self) -> str:
        """The recipe that the answers make."""
        raise NotImplementedError

    def run(self) -> None:
        """Asks all that is open."""
        while (question := next((q for q in self.questions() if q.key not in self.answers), None)) is not None:
            self.put(question)

    def put(self, question: Question) -> None:
        """Asks a question until there is an answer."""
        shown = _prompt(question)
        while True:
            try:
                self.answers[question.key] = answer(question, self.ask(shown), self.answers)
                return
            except UserError as mistake:
                self.tell(str(mistake))

    def change(self) -> bool:
        """Asks one of the questions anew, and what follows from it; False where nothing is to be changed."""
        asked = [q for q in self.questions() if q.key in self.answers]
        for number, question in enumerate(asked, start=1):
            self.tell(f"{number:3d}  {question.short}: {in_words(question, self.answers[question.key])}")
        place = self.number("Enter to go on, or the number of an answer to change: ", len(asked))
        if place is None:
            return False
        self.put(asked[place])
        self.run()
        return True

    def number(self, prompt: str, count: int) -> int | None:
        """The place of what somebody chose by its number, None where nothing was typed."""
        while typed := self.ask(prompt).strip():
            if typed.isdecimal() and 1 <= int(typed) <= count:
                return int(typed) - 1
            self.tell(f"{typed!r} is none of them: write a number from 1 to {count}")
        return None

    def sure(self, text: str) -> bool:
        """Yes or no."""
        return self._once(Question("", text, "choice", options=((YES, "yes"), (NO, "no")))) == YES

    def chosen(self, text: str, names: Sequence[str]) -> str:
        """One of several."""
        return self._once(Question("", text, "choice", options=tuple((name, name) for name in names)))

    def _once(self, question: Question) -> str:
        """The answer to a question that is asked before the others, and kept by nobody."""
        while True:
            try:
                return str(answer(question, self.ask(_prompt(question)), {}))
            except UserError as mistake:
                self.tell(str(mistake))


@dataclass
class ActuatorInterview(Interview):
    """first: the guess at the file; raw: the table that it is about. joined: designs that stand elsewhere."""

    first: Guess = field(kw_only=True)
    raw: RawTable = field(kw_only=True)
    joined: DesignGuess | None = field(kw_only=True, default=None)
    _known: dict[tuple[tuple[str, str], ...], Guess] = field(default_factory=dict)

    @property
    def found(self) -> Guess:
        """The guess once the answers are taken in."""
        meanings = said(self.first, self.answers)
        key = tuple(sorted(meanings.items()))
        if not meanings:
            return self.first
        if key not in self._known:
            # What stands elsewhere in the file stays.
            again = guess_table(self.raw, meanings)
            same = {name: getattr(self.first, name) for name in ("sheet", "sheets", "about", "recordings")}
            self._known = {key: replace(again, **same)}
        return self._known[key]

    def columns(self) -> None:
        """Lets whoever sees the table of the guess put columns right, by their numbers."""
        prompt = "Is every line right? Enter if so, else the number of one that is not: "
        while (place := self.number(prompt, len(self.first.columns))) is not None:
            self.put(meaning_of(self.first.columns[place]))

    def questions(self) -> Iterator[Question]:
        """Those about an actuator's file."""
        return questions(self.found, self.joined, self.answers)

    def recipe(self) -> str:
        """A recipe of a measurement table."""
        return draft(self.found, (), self.joined, self.answers)


@dataclass
class RubberInterview(Interview):
    """tests: as far as the files tell. name: of the files."""

    tests: Sequence[RubberGuess] = field(kw_only=True)
    name: str = field(kw_only=True)

    def columns(self) -> None:
        """Lets whoever sees the tests put the columns of one right, by its number."""
        prompt = "Is every line right? Enter if so, else the number of one that is not: "
        while (place := self.number(prompt, len(self.tests))) is not None:
            test = self.tests[place]
            self.put(mode_of(place + 1, test))
            for which, words in (("along", "stretch, strain or elongation"), ("stress", "stress or force")):
                options = tuple((c.name, f"{c.name} ({c.low:.4g} … {c.high:.4g})") for c in test.columns)
                text = f"Which column of {test.label} is the {words}?"
                self.put(Question(f"{place + 1}.{which}", text, "choice", "", options, None, text))

    def questions(self) -> Iterator[Question]:
        """Those about tests of rubber."""
        return rubber_questions(self.tests, self.answers)

    def recipe(self) -> str:
        """A recipe of a table of specimen tests."""
        return rubber_draft(self.tests, self.answers, self.name)


@dataclass
class WantedInterview(ActuatorInterview):
    """known: what a fitted run knows of its actuators."""

    known: Actuators = field(kw_only=True)

    def questions(self) -> Iterator[Question]:
        """Those about a file that asks something of the run."""
        return wanted_questions(self.found, self.known, self.answers)

    def recipe(self) -> str:
        """A recipe of a table of questions."""
        return wanted_draft(self.found, self.known, self.answers)


def _prompt(question: Question) -> str:
    """The question with its choices, and what Enter takes."""
    names = [name for name, _ in question.options]
    taken = "" if question.proposed is None else in_words(question, question.proposed)
    if names == [YES, NO]:
        return f"{question.text} [{'Y/n' if taken == YES else 'y/N' if taken else 'y/n'}]: "
    numbered = [f"{i}  {words}" for i, (_, words) in enumerate(question.options, start=1)]
    lines = [
        question.text,
        *(f"  {line}" for line in (numbered if len(numbered) <= MOST_LINES else _wrapped(numbered))),
    ]
    if names:
        number = names.index(str(question.proposed)) + 1 if taken else 0
        return "\n".join([*lines, f"  which [{number}]: " if number else "  which: "])
    where = f" ({question.told})" if question.told else ""
    text = f"{question.text}{where}{f' [{taken}]' if taken else _unit(question)}"
    return f"{text} " if text.endswith("?") else f"{text}: "


def _wrapped(words: Sequence[str]) -> list[str]:
    return wrap(",  ".join(word.replace(" ", "\u00a0") for word in words), 76, break_long_words=False)


def _unit(question: Question) -> str:
    unit = unit_of(question.column) if question.kind in ("number", "given") else ""
    return f" [{unit.replace('*', '·')}]" if unit else ""
