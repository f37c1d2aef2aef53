"""What headings leave open, as questions: what a column is, in which unit, and which way a load counts."""

from __future__ import annotations

from collections.abc import Iterator

from freelearn.data.intake.guesses.clock_spans import likely_unit
from freelearn.data.intake.guesses.guessed import SCALE, WHAT, WHICH, YES_OR_NO, Answers, ColumnGuess, Guess
from freelearn.data.intake.guesses.meanings import MEANINGS, NOT_USED, UNITS
from freelearn.data.intake.guesses.recipe_entries import percents
from freelearn.data.intake.guesses.typed_answers import Question
from freelearn.data.intake.laboratory_units import dimension, unit_of

# Columns that no heading explains are asked about one by one, up to so many.
MOST_UNKNOWN = 12
ALL = "all"
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


def meanings_open(found: Guess, answers: Answers) -> Iterator[Question]:
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
        if column.signal:
            yield from _gain(column, words, kind)
            continue
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


def _gain(column: ColumnGuess, words: str, kind: str) -> Iterator[Question]:
    """What a sensor's signal means."""
    wanted = "" if kind == "ratio" else column.column
    unit = unit_of(wanted).replace("*", "·") or "how much of it"
    text = f"The column {column.name!r}, the {words}, is in {column.signal}. How many {unit} is one {column.signal}"
    yield Question(
        f"{SCALE}{column.name}", text, "number", wanted, short=f"{unit} for each {column.signal} of {column.name!r}"
    )
    text = f"How many {column.signal} does {column.name!r} read where the {words} is 0"
    yield Question(f"offset.{column.name}", text, "number", short=f"{column.signal} of {column.name!r} at 0")


def signs_of_the_loads(found: Guess) -> Iterator[Question]:
    """Whether a positive force pulls, and whether a moment counts the other way than the table's."""
    for quantity, (text, short) in SIGNS.items():
        column = found.of(quantity)
        # A column with the table's own name has the table's own sign.
        if column is not None and column.name != quantity:
            yield Question(f"sign.{column.name}", text.format(repr(column.name)), "choice", "", YES_OR_NO, None, short)
