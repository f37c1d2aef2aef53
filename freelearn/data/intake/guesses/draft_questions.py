"""What a file does not say, as questions: for a number in the table's unit, a unit, or one of a few words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from freelearn.common.formats import listed
from freelearn.data.beds import BEDS, Bed
from freelearn.data.intake.guesses.clock_spans import clock_open, shift_key
from freelearn.data.intake.guesses.clocks import WHOSE_ROWS, clocks_in_words, in_order
from freelearn.data.intake.guesses.column_questions import meanings_open, signs_of_the_loads, units_open, which_of
from freelearn.data.intake.guesses.guessed import NO, PLATEAUS, YES, YES_OR_NO, Answers, Doubt, Guess
from freelearn.data.intake.guesses.joined import DesignGuess
from freelearn.data.intake.guesses.left_open import (
    COLUMN,
    DERIVE,
    EACH,
    ONE,
    RECORDED,
    SAME_SIZES,
    held_open,
    member_key,
    named_samples,
    of_each,
    open_design,
    quantities_given,
    rows_likely,
)
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.guesses.recordings_found import label_of
from freelearn.data.intake.guesses.typed_answers import HELD_AT, Question
from freelearn.data.intake.headings import RUN
from freelearn.data.intake.readers.told_elsewhere import Told


def questions(found: Guess, joined: DesignGuess | None, answers: Answers) -> Iterator[Question]:
    """All that are to be asked, those that have been answered among them; what comes next may depend on an answer."""
    yield from which_of(found, answers)
    yield from meanings_open(found, answers)
    yield from _clocks(found)
    yield from _rows(found, joined, answers)
    if joined is None and found.of("sample") is None:
        yield from _whose(found)
    yield from _recordings(found, answers)
    yield from _bed(found, answers)
    yield from _design(found, joined, answers)
    yield from units_open(found, answers)
    yield from _shifts(found, answers)
    yield from signs_of_the_loads(found)
    for doubt in found.doubts:
        if not doubt.rows:
            yield _asked(doubt)


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


def _whose(found: Guess) -> Iterator[Question]:
    """Whose several recordings are."""
    if not found.recordings:
        return
    called = ", ".join(map(label_of, found.recordings[:4])) + (", …" if found.recordings[4:] else "")
    text = f"There are {len(found.recordings)} recordings: {called}. Of which actuators are they?"
    options = ((ONE, "all of one actuator"), (EACH, "each of another actuator"))
    yield Question(RECORDED, text, "choice", options=options, short="the recordings are")


def _recordings(found: Guess, answers: Answers) -> Iterator[Question]:
    """Whether the table is a log, unless its rows are averaged."""
    if found.log is None or found.of("time_s") is None or answers.get(PLATEAUS) == YES:
        return
    count, named = max(found.log.recordings, len(found.recordings)), found.of(RUN)
    many = "one recording" if count == 1 else f"{count} recordings"
    options: tuple[tuple[str, str], ...] = ((DERIVE, f"samples in the order of time, in {many}: a log"),)
    if named:
        options += ((COLUMN, f"samples in the order of time, of the recordings that {named.name!r} names: a log"),)
    options += ((NO, "readings that stand for themselves, such as averages at rest"),)
    text, likely = "The file has a time. What are its rows?", rows_likely(found)
    yield Question(RUN, text, "choice", "", options, likely, "the rows are")


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
    return f"{listed(imposed)} were set, {' and '.join(read)} {verb} read"


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


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
