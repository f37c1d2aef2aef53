"""Columns of a file, and where recordings and joined channels stand, as a recipe writes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.data.intake.guesses.guessed import SCALE, YES, Answers, Clock, ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.left_open import EACH, ONE, RECORDED
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.laboratory_units import unit_of
from freelearn.data.intake.readers.raw_table import Place
from freelearn.data.intake.recipes.recipe import DATE

# Units as names of columns write them → as people do.
SPELLED = {"n": "N", "pa": "Pa", "kpa": "kPa", "nmm": "N·mm", "nm": "N·m"}
# A strain beyond it, without a unit, may be one in percent.
LARGEST_STRAIN = 1.5


def column_entry(column: ColumnGuess, name: str, answers: Answers) -> tuple[dict[str, Any], list[str]]:
    """A column of the recipe for the table's column `name`, with what is to be said of it."""
    meaning = MEANINGS[column.quantity or ""]
    unit = str(answers.get(f"unit.{column.name}", column.unit))
    entry: dict[str, Any] = {"from": column.own_name}
    remarks = []
    if column.dates:
        entry["unit"] = DATE
    elif f"{SCALE}{column.name}" in answers:
        entry |= {"unit": unit_of(name).replace("*", "·"), "scale": answers[f"{SCALE}{column.name}"]}
    elif column.signal and meaning.kind != "ratio":
        entry["unit"] = None
        wanted = unit_of(name).replace("*", "·")
        remarks.append(
            f"TODO: it is in {column.signal}: unit: {wanted}, scale: {wanted} for each {column.signal}, and offset: "
            "what it reads at 0"
        )
    elif unit:
        entry["unit"] = SPELLED.get(unit, unit)
    elif meaning.kind != "ratio":
        entry["unit"] = None
        remarks.append(f"TODO: the heading says no unit (the table's is {unit_of(name).replace('*', '·')})")
    elif percents(column):
        entry["unit"] = "?"
        remarks.append('TODO: % or "1"')
    turned = answers.get(f"sign.{column.name}") == YES
    for key, value in meaning.keys:
        entry[key] = -float(value) if key == "sign" and turned else value
    if turned and "sign" not in entry:
        entry["sign"] = -1
    elif entry.get("sign") == 1:
        del entry["sign"]
    if offset := answers.get(f"offset.{column.name}"):
        entry["offset"] = offset
    if meaning.words in ("contraction", "shortening"):
        remarks.append("a contraction shortens")
    if column.confidence != "sure" and f"unit.{column.name}" not in answers:
        remarks.append(f"{column.confidence}: check")
    return entry, remarks


def merge(content: dict[str, Any], more: Mapping[str, Any]) -> None:
    """Adds plain values to plain values: mappings are joined, lists go on.

    >>> a = {"drop": [1], "columns": {"force_n": {"unit": "N"}}}
    >>> merge(a, {"drop": [2], "columns": {"force_n": {"offset": 3}}})
    >>> a
    {'drop': [1, 2], 'columns': {'force_n': {'unit': 'N', 'offset': 3}}}
    """
    for key, value in more.items():
        there = content.get(key)
        if isinstance(there, dict) and isinstance(value, Mapping):
            merge(there, value)
        elif isinstance(there, list):
            content[key] = [*there, *value]
        else:
            content[key] = value


def percents(column: ColumnGuess) -> bool:
    """Whether a ratio without a unit may be one in percent."""
    strain = column.quantity in ("strain", "contraction")
    return strain and not column.unit and max(abs(column.low), abs(column.high)) > LARGEST_STRAIN


def read_of(place: Place) -> dict[str, Any]:
    """What a recipe says under `read` of columns that stand there."""
    sheet = {"sheet": place.sheet} if place.sheet else {}
    variables = {"variables": list(place.variables)} if place.variables else {}
    return sheet | variables | ({"names": list(place.names)} if place.names else {})


def listed_files(
    found: Guess, clocks: Sequence[Clock], lead: Place, answers: Answers, designed: bool
) -> list[dict[str, Any]]:
    """Where each recording stands, and whose it is. clocks: the first is the rows', which stand at `lead`. designed:
    whether designs that stand elsewhere say whose rows are."""
    pieces = list(found.recordings[0])
    own = pieces.index(lead) if lead in pieces else 0
    others = [pieces.index(found.named(clock.time).place) for clock in clocks[1:] if pieces[1:]]
    likely = ONE if found.log and found.log.likely else EACH
    each = answers.get(RECORDED, likely) == EACH
    named = designed or found.of("sample") is not None
    listed: list[dict[str, Any]] = []
    for number, recording in enumerate(found.recordings, start=1):
        place = recording[own]
        part: dict[str, Any] = {"name": place.file} if place.file else {}
        part |= {} if named else {"sample": number if each else 1}
        part |= _read(place) | ({"beside": [_beside(recording[at]) for at in others]} if others else {})
        listed.append(part)
    return listed


def _beside(place: Place) -> dict[str, Any]:
    return ({"file": place.file} if place.file else {}) | _read(place)


def _read(place: Place) -> dict[str, Any]:
    return {"read": read} if (read := read_of(place)) else {}


def of_joined(found: Guess, doubt: Doubt, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes of rows, for a channel whose rows are not those of the table: its words are blanks, and conditions name
    the column of the table."""
    (name,) = doubt.of
    column = found.named(name).column
    words = [word for one in changes.get("drop", ()) for word in one[name] if one[name] != "blank"]
    made: dict[str, Any] = {"columns": {column: {"blanks": words}}} if words else {}
    made |= {"slack": {column: changes["slack"][name]}} if "slack" in changes else {}
    return {key: value for key, value in changes.items() if key not in ("drop", "slack")} | made
