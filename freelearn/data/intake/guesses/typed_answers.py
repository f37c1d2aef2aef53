"""A question about a file, and what somebody typed as its answer: a number, a unit, or one of a few words."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from freelearn.common.errors import UserError
from freelearn.data.intake.guesses.guessed import NO, YES, Answers
from freelearn.data.intake.laboratory_units import conversion, unit_of

POSITIVE = ("length_mm", "inner_radius_mm", "outer_radius_mm")
_NUMBER = re.compile(r"([+\-−]?\d*[.,]?\d+(?:[eE][+-]?\d+)?)\s*(.*)")
_DIAMETER = re.compile(r"(?:d|ø|⌀|Ø|diameter|durchmesser)\s*=?\s*(.*)", re.IGNORECASE)
SAID_YES, SAID_NO = (
    ("y", "yes", "j", "ja", "o", "oui", "s", "si", "sí", "ano", "tak", "はい"),
    ("n", "no", "nein", "nee", "non", "ne", "nie", "いいえ"),
)
# Those about what was the same in all rows.
HELD_AT = "held."


@dataclass(frozen=True)
class Question:
    """text: as it is asked. kind: of the answer; given: a number, or ? where a fitted run is to answer it. column: of
    the table, in whose unit a number is and to which a unit has to convert ("" for a ratio). options: of a choice,
    answer → its words. proposed: what is likely; where there is nothing, an answer is needed. short: beside a field.
    told: where the file says what is proposed."""

    key: str
    text: str
    kind: Literal["number", "unit", "choice", "given"]
    column: str = ""
    options: tuple[tuple[str, str], ...] = ()
    proposed: str | float | None = None
    short: str = ""
    told: str = ""


def answer(question: Question, typed: str, answers: Answers) -> str | float:
    """What somebody typed as an answer; nothing is what is proposed. Raises UserError where it is none."""
    typed = typed.strip()
    if not typed and question.proposed is not None:
        return question.proposed
    if question.kind == "given" and typed == "?":
        return typed
    if question.key.startswith(HELD_AT) and typed.lower() in SAID_YES:
        return 0.0  # Yes, it was held at 0.
    if question.kind in ("number", "given"):
        inner = answers.get(question.key.replace("outer", "inner"))
        return _number(typed, question.column, inner)
    if question.kind == "unit":
        if not typed:
            raise UserError("a unit is needed: write one such as mm, in, kPa, bar, N, N·m, deg, rad, %")
        wanted = unit_of(question.column) if question.column else ""
        conversion("" if typed == "1" and not wanted else typed, wanted)
        return typed
    return _chosen(question, typed)


def _chosen(question: Question, typed: str) -> str:
    names = [name for name, _ in question.options]
    if set(names) == {YES, NO} and typed.lower() in (*SAID_YES, *SAID_NO):
        return YES if typed.lower() in SAID_YES else NO
    if typed.isdecimal() and 1 <= int(typed) <= len(names) and set(names) != {YES, NO}:
        return names[int(typed) - 1]
    for name, words in question.options:
        if typed.lower() in (name.lower(), words.lower()):
            return name
    if set(names) == {YES, NO}:
        raise UserError("write y or n")
    raise UserError(f"{typed!r} is none of them: write a number from 1 to {len(names)}")


def _number(typed: str, column: str, inner: str | float | None = None) -> float:
    """A number in the unit of the table's column; another unit may stand behind it: 0.25 in. inner: the radius to which
    an outer one may be given as the wall."""
    if column == "outer_radius_mm" and typed.startswith("+"):
        if not isinstance(inner, float):
            raise UserError("the inner radius is not known yet: write the outer radius itself")
        return float(f"{inner + _number(typed[1:], column):.12g}")
    if column in ("inner_radius_mm", "outer_radius_mm") and (match := _DIAMETER.fullmatch(typed)):
        return _number(match[1], column) / 2
    unit, found = unit_of(column), _NUMBER.fullmatch(typed)
    if not found:
        raise UserError(f"{typed!r} is no number: write one, such as 90 or 3.5 in")
    value = float(found[1].replace("−", "-").replace(",", "."))
    if found[2]:
        change = conversion(found[2], unit)
        value = change.factor * value + change.shift
    if value <= 0 and column in POSITIVE:
        raise UserError(f"{typed!r} is no size of an actuator: write a positive number")
    return float(f"{value:.12g}")


def in_words(question: Question, given: str | float) -> str:
    """An answer as it is shown."""
    if isinstance(given, float):
        return f"{given:g} {unit_of(question.column)}".strip().replace("*", "·")
    return dict(question.options).get(given, given)
