"""Questions about a raw file in the terminal, one after the other; any answer can be changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from textwrap import wrap

from freelearn.errors import UserError
from freelearn.measurements.intake.draft import draft
from freelearn.measurements.intake.guess import guess_table
from freelearn.measurements.intake.guessed import Guess
from freelearn.measurements.intake.joined import DesignGuess
from freelearn.measurements.intake.questions import Question, answer, in_words, meaning_of, questions, said
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.units import unit_of

# A choice of more has several on a line.
MOST_LINES = 8
# Asks a question and gives what was typed.
Ask = Callable[[str], str]


@dataclass
class Interview:
    """found: the guess at the file as far as it is known. tell: shows a sentence. answers: by the keys of questions."""

    first: Guess
    joined: DesignGuess | None
    raw: RawTable
    ask: Ask
    tell: Callable[[str], None]
    answers: dict[str, str | float] = field(default_factory=dict)
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
            self._known = {key: replace(again, sheet=self.first.sheet, about=self.first.about)}
        return self._known[key]

    def columns(self) -> None:
        """Lets whoever sees the table of the guess put columns right, by their numbers."""
        columns = self.first.columns
        while typed := self.ask("Is every line right? Enter if so, else the number of one that is not: ").strip():
            if typed.isdigit() and 1 <= int(typed) <= len(columns):
                self._put(meaning_of(columns[int(typed) - 1]))
            else:
                self.tell(f"{typed!r} is none of them: write a number from 1 to {len(columns)}")

    def run(self) -> None:
        """Asks all that is open."""
        while (question := self._open()) is not None:
            self._put(question)

    def _open(self) -> Question | None:
        found = self.found
        return next((q for q in questions(found, self.joined, self.answers) if q.key not in self.answers), None)

    def _put(self, question: Question) -> None:
        shown = _prompt(question)
        while True:
            try:
                self.answers[question.key] = answer(question, self.ask(shown), self.answers)
                return
            except UserError as mistake:
                self.tell(str(mistake))

    def change(self) -> bool:
        """Asks one of the questions anew, and what follows from it; False where nothing is to be changed."""
        asked = [q for q in questions(self.found, self.joined, self.answers) if q.key in self.answers]
        for number, question in enumerate(asked, start=1):
            self.tell(f"{number:3d}  {question.short}: {in_words(question, self.answers[question.key])}")
        while True:
            typed = self.ask("Enter to go on, or the number of an answer to change: ").strip()
            if not typed:
                return False
            if typed.isdigit() and 1 <= int(typed) <= len(asked):
                self._put(asked[int(typed) - 1])
                self.run()
                return True
            self.tell(f"{typed!r} is none of them: write a number from 1 to {len(asked)}")

    def recipe(self) -> str:
        """The recipe that the answers make."""
        return draft(self.found, (), self.joined, self.answers)


def _prompt(question: Question) -> str:
    """The question with its choices, and what Enter takes."""
    names = [name for name, _ in question.options]
    taken = "" if question.proposed is None else in_words(question, question.proposed)
    if names == ["yes", "no"]:
        return f"{question.text} [{'Y/n' if taken == 'yes' else 'y/N' if taken else 'y/n'}]: "
    numbered = [f"{i}  {words}" for i, (_, words) in enumerate(question.options, start=1)]
    lines = [
        question.text,
        *(f"  {line}" for line in (numbered if len(numbered) <= MOST_LINES else _wrapped(numbered))),
    ]
    if names:
        number = names.index(str(question.proposed)) + 1 if taken else 0
        return "\n".join([*lines, f"  which [{number}]: " if number else "  which: "])
    where = f" ({question.told})" if question.told else ""
    return f"{question.text}{where}{f' [{taken}]' if taken else _unit(question)}: "


def _wrapped(words: Sequence[str]) -> list[str]:
    return wrap(",  ".join(word.replace(" ", "\u00a0") for word in words), 76, break_long_words=False)


def _unit(question: Question) -> str:
    unit = unit_of(question.column) if question.kind == "number" else ""
    return f" [{unit.replace('*', '·')}]" if unit else ""
