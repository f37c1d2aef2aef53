"""Friction in the first rows of states that begin under pressure, and in several readings at one pressure."""

from functools import cache

import numpy as np
import pytest

import freelearn as fl
from freelearn.data.accuracy import PAPER
from freelearn.data.columns import RISEN
from freelearn.data.rows import Rows
from freelearn.data.states import pressure_direction
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.testing.effect_page import in_library
from freelearn.testing.reference.laboratory import Laboratory, measure

ACTUATORS = {3: (36.0, 98.42, 4.77, 6.74)}
NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
FRICTION = "friction_hysteresis"
HIDDEN = {FRICTION: {"force": 0.25, "moment": 0.01}}
OTHERS = [name for name, effect in EFFECTS.items() if in_library(effect) and name not in (FRICTION, "force_offset")]


def table_of(effects, noise, falling=3, seed=5):
    """In the literature's form of friction, whose rows the package's formulas did not make."""
    table = measure(
        Laboratory(states=24, pressures=6, falling=falling), ACTUATORS, 8e5, 2e7, effects, noise, seed
    ).table
    return table[table["buckled"] == 0].reset_index(drop=True)


def from_the_second_row(table):
    """Without the row of each state at which nothing presses yet: filled from there all the same."""
    later = table[table["step"] > 0]
    return later.assign(step=later["step"] - 1).reset_index(drop=True)


def moved_under_pressure():
    """The same rows, of a bed that went to each state under the pressure of its first row: friction begins after it."""
    rubbed, smooth = (from_the_second_row(table_of(effects, NOISE)) for effects in (HIDDEN, {}))
    loads = ["force_n", "moment_nmm"]
    rubbed.loc[rubbed["step"] == 0, loads] = smooth.loc[smooth["step"] == 0, loads]
    return rubbed


def read_several_times(times=3):
    """Each pressure read as often, each reading with its own noise."""
    table = table_of(HIDDEN, dict.fromkeys(NOISE, 0.0))
    rows = table.loc[np.repeat(table.index, times)].reset_index(drop=True)
    state = (table["step"] == 0).cumsum().to_numpy()
    rows["step"] = rows.groupby(np.repeat(state, times)).cumcount()
    noise = np.random.default_rng(3)
    for name in ("pressure_kpa", "force_n", "moment_nmm"):
        rows[name] += noise.normal(0, NOISE[name], len(rows))
    return rows


@cache
def searched(made):
    table = {
        "filled": lambda: from_the_second_row(table_of(HIDDEN, NOISE)),
        "moved": moved_under_pressure,
        "several": read_several_times,
        "rising": lambda: from_the_second_row(table_of(HIDDEN, NOISE, falling=0)),
        "zero": lambda: from_the_second_row(table_of({"force_offset": {"force": 0.3}}, NOISE, falling=0)),
    }[made]()
    rows = Rows.from_table(table)
    return search(question_of_rows(lambda names: build_model("continuum", {}, names), table.columns, rows, PAPER, 0))


@pytest.mark.parametrize("made", ["filled", "moved", "several"])
def test_friction_is_named_and_as_large_as_it_is(made):
    found = searched(made)
    assert (found.verdict, found.effects) == ("named", [FRICTION])
    values = found.final.fit.values()
    for name, value in HIDDEN[FRICTION].items():
        assert values[f"{FRICTION}.{name}"] == pytest.approx(value, rel=0.15)


def test_in_rows_that_only_rise_from_above_rest_friction_is_a_zero_of_the_loads():
    """Neither is named for the other."""
    assert searched("rising").verdict == "undecided"
    found = searched("zero")
    assert found.verdict == "class"
    (members,) = found.classes
    assert {"force_offset", FRICTION} <= set(members)


def test_a_search_says_how_first_rows_were_taken_and_a_column_overrules_it():
    table = from_the_second_row(table_of(HIDDEN, NOISE))
    found = fl.discover(table, ruled_out=OTHERS, progress=False)
    assert found.effects == [FRICTION]
    assert any("begin under pressure" in note for note in found.content["notes"])
    # Whoever takes the run up reads it as the search did.
    assert fl.referee(found).verdict == found.content["verdict"]
    told = fl.discover(table.assign(risen=1), ruled_out=OTHERS, progress=False)
    assert not any("begin under pressure" in note for note in told.content["notes"])
    assert told.content["error"] == found.content["error"]
    fits = [fl.fit(table.assign(risen=mark), effects=[FRICTION], progress=False) for mark in (0, 1)]
    moved, filled = (fit.run.content["tests"]["all"]["E"] for fit in fits)
    assert filled < 0.9 * moved


def test_the_direction_is_that_of_the_last_change_that_is_one():
    table = table_of({}, dict.fromkeys(NOISE, 0.0)).iloc[:9].assign(step=range(9))
    table["pressure_kpa"] = [10.0, 10.2, 40.0, 39.9, 40.1, 70.0, 40.0, 40.3, 10.0]
    assert pressure_direction(table).tolist() == [0, 0, 1, 1, 1, 1, -1, -1, -1]
    assert pressure_direction(table.assign(**{RISEN: 1})).tolist() == [1, 1, 1, 1, 1, 1, -1, -1, -1]
