"""What a file does not say, as questions: for a number in the table's unit, a unit, or one of a few words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS, Bed
from freelearn.data.intake.guesses.clock_spans import clock_open, likely_unit, shift_key
from freelearn.data.intake.guesses.clocks import WHOSE_ROWS, clocks_in_words, in_order
from freelearn.data.intake.guesses.draft import (
    SAME_SIZES,
    Answers,
    held_open,
    member_key,
    named_samples,
    of_each,
    open_design,
    percents,
    quantities_given,
)
from freelearn.data.intake.guesses.guessed import NO, WHAT, WHICH, YES, YES_OR_NO, ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.joined import DesignGuess
from freelearn.data.intake.guesses.meanings import MEANINGS, NOT_USED, UNITS
from freelearn.data.intake.laboratory_units import conversion, dimension, unit_of
from freelearn.data.intake.readers.told_elsewhere import Told

POSITIVE = ("length_mm", "inner_radius_mm", "outer_radius_mm")
_NUMBER = re.compile(r"([+\-−]?\d*[.,]?\d+(?:[eE][+-]?\d+)?)\s*(.*)")
_DIAMETER = re.compile(r"(?:d|ø|⌀|Ø|diameter|durchmesser)\s*=?\s*(.*)", re.IGNORECASE)
SAID_YES, SAID_NO = (
    ("y", "yes", "j", "ja", "o", "oui", "s", "si", "sí", "ano", "tak", "はい"),
    ("n", "no", "nein", "nee", "non", "ne", "nie", "いいえ"),
)
# Columns that no heading explains are asked about one by one, up to so many.
MOST_UNKNOWN = 12
ALL = "all"
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


def questions(found: Guess, joined: DesignGuess | None, answers: Answers) -> Iterator[Question]:
    """All that are to be asked, those that have been answered among them; what comes next may depend on an answer."""
    yield from which_of(found, answers)
    yield from _meanings(found, answers)
    yield from _clocks(found)
    yield from _rows(found, joined, answers)
    yield from _bed(found, answers)
    yield from _design(found, joined, answers)
    yield from units_open(found, answers)
    yield from _shifts(found, answers)
    yield from signs_of_the_loads(found)
    for doubt in found.doubts:
        if not doubt.rows:
            yield _asked(doubt)


def said(found: Guess, answers: Answers) -> dict[str, str]:
    """What was said of columns: name → meaning. found: before anything was said."""
    meanings = {key.removeprefix(WHAT): str(value) for key, value in answers.items() if key.startswith(WHAT)}
    one = answers.get("parallel", ALL)
    if one != ALL:
        others = [c.name for c in found.columns if meanings.get(c.name, c.quantity) == "pressure_kpa"]
        meanings |= {name: NOT_USED for name in others if name != one}
    for first, *others in found.rivals:
        if chosen := answers.get(WHICH + first):
            quantity = next((c.quantity for c in found.columns if c.name == first), None)
            meanings |= {name: (quantity or NOT_USED) if name == chosen else NOT_USED for name in (first, *others)}
    return meanings


def which_of(found: Guess, answers: Answers) -> Iterator[Question]:
    """Which column is meant, where several say the same."""
    by_name = {c.name: c for c in found.columns}
    for names in found.open_rivals(answers):
        options = tuple((n, f"{n} ({by_name[n].low:.4g} … {by_name[n].high:.4g})") for n in names)
        text = f"{', '.join(map(repr, names))} say the same quantity. Which one is to be taken?"
        yield Question(WHICH + names[0], text, "choice", options=options, short=" or ".join(map(repr, names)))


def _meanings(found: Guess, answers: Answers) -> Iterator[Question]:
    """Columns of numbers that no heading explains, where the table lacks something; and whose pressures several are."""
    given = {c.column for c in found.columns if c.chosen and WHAT + c.name not in answers}
    lacks = not given & {"force_n", "moment_nmm"} or "pressure_kpa" not in given
    # A length may be the elongation that is lacking, an angle the twist.
    kinds = {kind for name, kind in (("elongation_mm", "length"), ("twist_deg", "angle")) if name not in given}
    # One that was said to be unused is sure.
    open_ones = [
        c.name
        for c in found.columns
        if c.quantity is None and c.confidence != "sure" and (lacks or (c.unit and dimension(c.unit) in kinds))
    ]
    unknown = [c for c in found.columns if c.numeric and (WHAT + c.name in answers or c.name in open_ones)]
    for column in unknown[:MOST_UNKNOWN]:
        yield meaning_of(column)
    if len(found.pressures) > 1:
        count = len(found.pressures)
        text = f"{', '.join(found.pressures)}: whose pressures are they?"
        each = ((name, f"the actuator's is {name!r}; the others are not used") for name in found.pressures)
        options = ((ALL, f"of {count} actuators side by side on one end block, each its own"), *each)
        yield Question("parallel", text, "choice", options=options, short="pressures")


def meaning_of(column: ColumnGuess) -> Question:
    """What one column is."""
    options = ((NOT_USED, NOT_USED), *((name, meaning.words) for name, meaning in MEANINGS.items()))
    text = f"What is the column {column.name!r} ({column.low:.4g} … {column.high:.4g}, first {column.example})?"
    return Question(WHAT + column.name, text, "choice", options=options, short=f"column {column.name!r}")


def _clocks(found: Guess) -> Iterator[Question]:
    """Of several clocks the one whose rows the table has."""
    if not found.clocks:
        return
    told = clocks_in_words(found, found.clocks)
    # Pressures of several actuators are read from the table's own rows.
    may_lead = found.clocks[:1] if found.pressures else found.clocks
    options = ((clock.time, f"those of {clock.time!r}, the others joined to it by time") for clock in may_lead)
    alone = (NO, "as they stand: what stands in one row is of one moment, and nothing is joined")
    text = f"{told[:1].upper()}{told[1:]}. Which rows shall the table have?"
    yield Question(WHOSE_ROWS, text, "choice", "", (*options, alone), found.clocks[0].time, "rows of the table")


def _shifts(found: Guess, answers: Answers) -> Iterator[Question]:
    """How far clocks that have no time in common lie apart."""
    for clock in (clocks := in_order(found, answers))[1:]:
        lead, other = found.named(clocks[0].time), found.named(clock.time)
        if not (left := clock_open(lead, other, answers)):
            continue
        if lead.dates == other.dates:
            between = left.partition(": add")[0]
            text = f"{between}: how many seconds are to be added to {other.name!r}, negative to take off"
            short = f"seconds added to {other.name!r}"
        else:
            dated, counted = (lead, other) if lead.dates else (other, lead)
            text = f"{left.partition(': say')[0]}: at which second of {counted.name!r} was {dated.example}"
            short = f"second of {counted.name!r} at {dated.example}"
        yield Question(shift_key(clock), text, "number", "time_s", short=short)


def _asked(doubt: Doubt) -> Question:
    return Question(doubt.key, doubt.text, "choice", "", doubt.options, doubt.proposed, doubt.short)


def _rows(found: Guess, joined: DesignGuess | None, answers: Answers) -> Iterator[Question]:
    for doubt in found.doubts:
        if doubt.rows:
            yield _asked(doubt)
    if found.perhaps and joined is None:
        words = ", ".join(found.perhaps_words[:4])
        text = f"Whose are the rows? The column {found.perhaps!r} says {words}"
        options = (("one", "all of one actuator"), ("column", f"{found.perhaps!r} says of which"))
        yield Question("sample", text, "choice", options=options, short="the rows are")
    if len(named_samples(found, joined, answers)) > 1 and set(open_design(found, joined)) - {"length_mm"}:
        text = "Have these actuators all the same fiber angle and the same radii?"
        yield Question("alike", text, "choice", options=YES_OR_NO, short="the same angle and radii")


def _bed(found: Guess, answers: Answers) -> Iterator[Question]:
    given = set(quantities_given(found))
    may_be = [name for name, bed in BEDS.items() if _reads(name, bed, given)]
    if "bed" in answers or len(may_be) > 1:
        options = tuple((name, bed_in_words(BEDS[name])) for name in may_be)
        proposed = found.bed if found.bed in may_be else None
        yield Question("bed", "What did the rig set, and what did it read?", "choice", "", options, proposed, "bed")


def _reads(name: str, bed: Bed, given: set[str]) -> bool:
    """Whether these columns may be readings of a bed: of one that reads a single one of them another bed is meant."""
    read = given & {q.column for q in bed.measured}
    if name == "inflation" or "outer_diameter_mm" in given:
        return name == "inflation" and "outer_diameter_mm" in given
    return len(read) == 2 if name == "kinematic" else bool(read) and (name != "isometric" or "moment_nmm" not in given)


def bed_in_words(bed: Bed) -> str:
    """What a bed sets and reads.

    >>> bed_in_words(BEDS["isometric"])
    'elongation, twist and pressure were set, force was read'
    """
    imposed, read = ([q.name for q in part] for part in (bed.imposed, bed.measured))
    verb = "was" if len(read) == 1 else "were"
    return f"{', '.join(imposed[:-1])} and {imposed[-1]} were set, {' and '.join(read)} {verb} read"


def _design(found: Guess, joined: DesignGuess | None, answers: Answers) -> Iterator[Question]:
    design = open_design(found, joined)
    several = named_samples(found, joined, answers)
    apart = [name for name in design if several and (name == "length_mm" or answers.get("alike") == NO)]
    if found.pressures:
        yield from _of_members(found, design, answers)
    for name, about in design.items():
        if name in apart:
            for number, word in several:
                text = f"{_capital(about)} of {word}"
                yield Question(f"design.{name}.{number}", text, "number", name, short=text)
        elif name not in of_each(found, design, answers):
            yield _part(f"design.{name}", name, _capital(about), found.told(name))
            if name == "gamma_deg" and "gamma2_deg" not in quantities_given(found):
                yield _braid("Is it a braid (McKibben, Festo), with as many fibers wound the other way?")
    for name in held_open(found, str(answers.get("bed", found.bed))):
        words = MEANINGS[name].words
        text = f"No column is the {words}: which {words} was held throughout? 0 if it was held at 0"
        yield Question(f"{HELD_AT}{name}", text, "number", name, short=f"{_capital(words)} that was held")


def _of_members(found: Guess, design: Mapping[str, str], answers: Answers) -> Iterator[Question]:
    """What each of several actuators on an end block has of its own."""
    if "gamma_deg" in design:
        for number, name in enumerate(found.pressures, start=1):
            text = f"Fiber angle to the axis of the actuator at {name}, negative for the other sense of winding"
            told = found.told("gamma_deg", number)
            yield _part(member_key("gamma_deg", number), "gamma_deg", f"fiber angle at {name}", told, text)
        yield _braid("Are they braids (McKibben, Festo), with as many fibers wound the other way?")
    if set(design) - {"gamma_deg"}:
        text = "Have these actuators all the same unloaded length and the same radii?"
        proposed = NO if found.sizes_apart else None
        yield Question(SAME_SIZES, text, "choice", "", YES_OR_NO, proposed, "the same length and radii")
    for number, name in enumerate(found.pressures, start=1):
        for part in of_each(found, design, answers):
            if part != "gamma_deg":
                short = f"{_capital(design[part])} of the actuator at {name}"
                yield _part(member_key(part, number), part, short, found.told(part, number))


def _part(key: str, name: str, short: str, told: Told | None, text: str = "") -> Question:
    """A part of the design, with what the file says of it elsewhere."""
    proposed, where = (told.value, told.words) if told else (None, "")
    text = text or short + HOW.get(name, "")
    return Question(key, text, "number", name, proposed=proposed, short=short, told=where)


HOW = {
    "gamma_deg": ", 0° along it, 90° around it",
    "inner_radius_mm": ", or d and the diameter",
    "outer_radius_mm": ", or d and the diameter, or + and the wall",
}


def _braid(text: str) -> Question:
    return Question("braid", text, "choice", options=YES_OR_NO, short="a braid, with a second family of fibers")


def units_open(found: Guess, answers: Answers) -> Iterator[Question]:
    """The units that no heading says."""
    before: dict[str, str | None] = {}
    for column in (c for c in found.columns if c.chosen and not c.dates):
        kind = MEANINGS[column.quantity or ""].kind
        if (
            not kind
            or (column.unit and f"unit.{column.name}" not in answers)
            or (kind == "ratio" and not percents(column))
        ):
            continue
        words = MEANINGS[column.quantity or ""].words
        such, numbers = ", ".join(UNITS[kind][:3]), f"{column.low:.4g} … {column.high:.4g}"
        text = f"Which unit has the column {column.name!r}, the {words} ({numbers}), such as {such}?"
        wanted = "" if kind == "ratio" else column.column
        if kind == "time":
            before[kind] = likely_unit(found, column, answers)
        yield Question(
            f"unit.{column.name}", text, "unit", wanted, proposed=before.get(kind), short=f"unit of {column.name!r}"
        )
        if kind == "pressure" and (unit := answers.get(f"unit.{column.name}")):
            before[kind] = str(unit)


# Of each load the question whose yes turns its sign, and the same in short.
SIGNS = {
    "force_n": (
        "Does a positive reading of {} mean that the actuator pulls, as a muscle does?",
        "a positive force is a pull",
    ),
    "moment_nmm": (
        "Without pressure, does the reading of {} rise as the actuator is turned the positive way of the twist?",
        "the moment rises with the twist",
    ),
}


def signs_of_the_loads(found: Guess) -> Iterator[Question]:
    """Whether a positive force pulls, and whether a moment counts the other way than the table's."""
    for quantity, (text, short) in SIGNS.items():
        column = found.of(quantity)
        # A column with the table's own name has the table's own sign.
        if column is not None and column.name != quantity:
            yield Question(f"sign.{column.name}", text.format(repr(column.name)), "choice", "", YES_OR_NO, None, short)


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


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def lacking(found: Guess, joined: DesignGuess | None, answers: Answers) -> list[Question]:
    """Questions without an answer, and without one that may be taken for granted."""
    return [q for q in questions(found, joined, answers) if q.key not in answers]
