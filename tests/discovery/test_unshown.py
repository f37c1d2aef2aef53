"""Effects that act in rows which cannot show them: nothing else is claimed in their place, nor are they."""

from dataclasses import replace
from functools import cache

import pytest

import freelearn as fl
from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.referee.case import ROWS_SHOW
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import candidates, question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.records.discovery import unshown_notes
from freelearn.testing.reference.laboratory import Laboratory, measure

ACTUATORS = {3: (36.0, 98.42, 4.77, 6.74), 6: (62.0, 99.0, 4.77, 6.36)}
NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
FRICTION = "friction_hysteresis"
HIDDEN = {FRICTION: {"force": 0.4, "moment": 0.015}}


def table_of(effects, falling, seed=5):
    """In the literature's form of friction, whose rows the package's formulas did not make."""
    bed = Laboratory(states=16, pressures=5, falling=falling)
    table = measure(bed, ACTUATORS, 8e5, 2e7, effects, NOISE, seed).table
    return table[table["buckled"] == 0].reset_index(drop=True)


def build(names):
    return build_model("continuum", {}, names, list(ACTUATORS))


@cache
def searched(hidden, falling):
    table = table_of(HIDDEN if hidden else {}, falling)
    rows = Rows.from_table(table)
    return search(question_of_rows(build, table.columns, rows, PAPER, 0))


def test_friction_in_rising_rows_is_neither_claimed_nor_written_anew():
    found = searched(True, 0)
    assert found.verdict == "undecided"
    assert not found.proposals
    assert FRICTION in found.effects
    (check,) = (c for c in found.referee.checks if c.name == ROWS_SHOW)
    assert "rows of falling pressure" in check.says


def test_rows_that_fall_name_it():
    found = searched(True, 3)
    assert (found.verdict, found.effects) == ("named", [FRICTION])
    assert not any(c.name == ROWS_SHOW for c in found.referee.checks)


def test_where_nothing_hides_rising_rows_are_adequate():
    assert searched(False, 0).verdict == "adequate"


def test_it_stands_in_the_class_of_what_it_could_stand_in_for_and_a_note_says_what_would_tell():
    """The answer with friction among what fits as well: it is told last, and no state is asked to tell it."""
    found = searched(False, 0)
    shown = next(iter(found.steps))
    members = {"force_offset": shown, "length_offset": shown, FRICTION: shown}
    (note,) = unshown_notes(replace(found, classes=[members]), {FRICTION: "needs rows of falling pressure"})
    assert note == (
        f"{FRICTION} would do as well as force_offset, and these rows cannot show it: it needs rows of falling pressure"
    )
    assert not unshown_notes(replace(found, classes=[{FRICTION: shown}]), {FRICTION: "needs rows"})


def test_a_search_of_such_a_table_ends_in_words_and_lists_the_effect_as_not_testable():
    table = table_of(HIDDEN, 0)
    found = fl.discover(table, progress=False)
    assert found.verdict == "undecided"
    assert f"{FRICTION} would explain what is missing, but these rows cannot show it" in found.content["says"]
    assert "If anything is missing" not in found.content["says"]
    entries = [c["status"] for c in found.content["candidates"] if c["effect"] == FRICTION]
    assert entries == ["not_testable"]
    assert not any(FRICTION in proposed["separates"] for proposed in found.content["next_experiment"])
    # A referee of the run asks what the search was asked.
    assert "falling pressure" in found.content["unshown"][FRICTION]


def test_who_knows_that_there_is_none_says_so():
    found = fl.discover(table_of({}, 0), ruled_out=[FRICTION], progress=False)
    assert FRICTION not in found.content["unshown"]
    assert "contact_friction" in found.content["unshown"]


@pytest.mark.parametrize("falling", [0, 3])
def test_only_rows_that_cannot_show_an_effect_make_it_unshown(falling):
    table = table_of({}, falling)
    rows = Rows.from_table(table)
    unshown = candidates(build([]), [], table.columns, rows).unshown
    assert (FRICTION in unshown) == (falling == 0)
    # What a table lacks a column for, or a model or bed does not have, acts nowhere.
    acting = {FRICTION, "contact_friction", "pressure_hysteresis", "stress_softening", "relaxation"}
    assert set(unshown) <= acting
