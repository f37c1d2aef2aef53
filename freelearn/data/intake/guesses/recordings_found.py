"""Recordings of one form, in files, sheets, structures or matrices: which belong to one test, and which repeat it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile

from freelearn.data.intake.readers.raw_files import in_natural_order
from freelearn.data.intake.readers.raw_table import Place, RawTable

# Of sheets that look alike: all of them.
EVERY = "all of them: each is a recording"
Form = tuple[str, ...]
# Where the channels of one recording stand, those of each form once.
Recording = tuple[Place, ...]


def recordings_of(tables: Sequence[tuple[Place, Form]]) -> tuple[Recording, ...]:
    """The recordings that tables are of, if several have one form, and of each form there are as many, called alike:
    test1/force.csv and test1/pressure.csv, test2/force.csv and test2/pressure.csv; () where they are none. What has a
    form of its own, such as a list of designs, belongs to none."""
    forms: dict[Form, list[Place]] = {}
    for place, form in tables:
        forms.setdefault(form, []).append(place)
    labeled = [labels(places) for places in forms.values() if len(places) > 1]
    if not labeled or any(set(one) != set(labeled[0]) for one in labeled):
        return ()
    return tuple(tuple(of[label] for of in labeled) for label in sorted(labeled[0], key=in_natural_order))


def labels(places: Sequence[Place]) -> dict[str, Place]:
    """What tells places of one form apart → the place: their names without what all of them begin and end with."""
    names = [place.called for place in places]
    before = re.sub(r"\d+$", "", _begin_alike(names))
    after = re.sub(r"^\d+", "", _begin_alike([name[len(before) :][::-1] for name in names])[::-1])
    return {name[len(before) : len(name) - len(after)]: place for name, place in zip(names, places, strict=True)}


def _begin_alike(names: Sequence[str]) -> str:
    """What all of the names begin with."""
    same = takewhile(lambda signs: len(set(signs)) == 1, zip(*names, strict=False))
    return "".join(signs[0] for signs in same)


def form_of(table: RawTable) -> Form:
    """Tables of one form have the same headings, with the same units."""
    return tuple(f"{name} [{table.units.get(name, '')}]" for name in table.columns)


def label_of(recording: Recording) -> str:
    """What a recording is called: by the first of its places."""
    return recording[0].called
