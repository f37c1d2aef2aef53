"""Where the readings of several recordings, and of channels that are joined, stand: as a recipe says it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.data.intake.guesses.guessed import Answers, Clock, Doubt, Guess
from freelearn.data.intake.guesses.left_open import EACH, ONE, RECORDED
from freelearn.data.intake.readers.raw_table import Place


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
