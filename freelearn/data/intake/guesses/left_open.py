"""What of a table neither a file nor a design says, and what answers to questions make of it."""

from __future__ import annotations

from collections.abc import Mapping

from freelearn.data.beds import BEDS
from freelearn.data.intake.guesses.guessed import NO, PLATEAUS, YES, Answers, ColumnGuess, Guess
from freelearn.data.intake.guesses.joined import DesignGuess
from freelearn.data.intake.guesses.recordings_found import label_of
from freelearn.data.intake.headings import RUN
from freelearn.data.intake.recipes.recipe import DESIGN, FURTHER, READINGS

CONSTANTS = {
    "gamma_deg": "fiber angle to the axis",
    "length_mm": "unloaded length",
    "inner_radius_mm": "unloaded inner radius",
    "outer_radius_mm": "unloaded outer radius",
}
# How a log's recordings are told: as its time begins anew, or by a column.
DERIVE, COLUMN = "derive", "column"
# Whose several recordings are: all of one actuator, or each of another.
RECORDED, ONE, EACH = "recorded", "one", "each"
# Whether the actuators on an end block have the same sizes.
SAME_SIZES = "same_sizes"


def rows_likely(found: Guess) -> str:
    """How the recordings of a log are likely told; NO where the rows do not look like one."""
    if found.log is None or not found.log.likely:
        return NO
    return DERIVE if found.of(RUN) is None else COLUMN


def recordings_said(found: Guess, answers: Answers) -> str | None:
    """How the recordings of a log are told; None where the table is to be none."""
    plateaus = next((doubt for doubt in found.doubts if doubt.key == PLATEAUS), None)
    averaged = plateaus is not None and answers.get(PLATEAUS, plateaus.proposed) == YES
    if found.log is None or found.of("time_s") is None or averaged:
        return None
    said = str(answers.get(RUN, rows_likely(found)))
    return None if said == NO or (said == COLUMN and found.of(RUN) is None) else said


def open_design(found: Guess, joined: DesignGuess | None) -> dict[str, str]:
    """What of the design no column says, with what it is called."""
    said = {*quantities_given(found), *(joined.columns if joined else ())}
    return {name: about for name, about in CONSTANTS.items() if name not in said}


def held_open(found: Guess, bed: str) -> list[str]:
    """What a bed imposes and no column says."""
    given = quantities_given(found)
    several = bool(found.pressures)
    return [
        q.column for q in BEDS[bed].imposed if q.column not in given and not (several and q.column == "pressure_kpa")
    ]


def named_samples(found: Guess, joined: DesignGuess | None, answers: Answers) -> list[tuple[int, str]]:
    """The number and the word of each of several actuators whose designs are to be given one by one."""
    if joined is not None:
        return []
    if found.recordings:
        named = [(number, label_of(one)) for number, one in enumerate(found.recordings, start=1)]
        return named if answers.get(RECORDED) == EACH else []
    if found.of("sample") is None and answers.get("sample") == "column":
        return list(enumerate(found.perhaps_words, start=1))
    return sample_keys(found) if len(found.samples) > 1 else []


def member_key(name: str, number: int) -> str:
    """The key of the question about a part of a member's design."""
    return f"member.{number}" if name == "gamma_deg" else f"design.{name}.{number}"


def of_each(found: Guess, design: Mapping[str, str], answers: Answers) -> list[str]:
    """What of the design each actuator on an end block is asked for: its angle, and its sizes where they differ."""
    apart = answers.get(SAME_SIZES, NO if found.sizes_apart else YES) == NO
    return [name for name in design if name == "gamma_deg" or apart] if found.pressures else []


def sample_keys(found: Guess) -> list[tuple[int, str]]:
    """The number and the word of each actuator; words that are numbers keep them."""
    if numbered(found):
        return sorted((int(float(word)), word) for word in found.samples)
    return list(enumerate(found.samples, start=1))


def numbered(found: Guess) -> bool:
    """Whether the file numbers its actuators 1, 2, … itself."""
    return all(word.removesuffix(".0").isdecimal() and float(word) >= 1 for word in found.samples)


def quantities_given(found: Guess) -> dict[str, ColumnGuess]:
    """Column of the table → the file's column that becomes it."""
    others = {clock.time for clock in found.clocks[1:]}
    chosen = {c.column: c for c in found.columns if c.chosen and c.name not in (*found.pressures, *others)}
    order = (*DESIGN, "elongation_mm", "twist_deg", "pressure_kpa", *READINGS, *FURTHER)
    return {name: chosen[name] for name in order if name in chosen}
