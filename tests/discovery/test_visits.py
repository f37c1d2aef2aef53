"""Places that are visited several times: one state where they are off alike each time, states of their own else."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from linear_bed import ACCURACY, TRUE, LinearBed

from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.fits.visits import joined_visits
from freelearn.discovery.fits.white_fit import evaluated
from freelearn.physics.effects.registry import make_effects
from freelearn.testing.reference.other_beds import nominal

LENGTHS, PRESSURES, VISITS = np.array([-4.0, -2.0, 0.0, 2.0, 4.0]), np.linspace(0, 70, 8), 3
# What a carriage is off by, mm: as stated.
OFF = 0.03


def springs(names):
    return LinearBed(make_effects(names, LinearBed.family))


def measured(seed, again=0.0, drift=0.0, visits=VISITS):
    """Rows of the linear bed at places that are off by OFF, by so much anew at each visit (again, mm), and by a force
    zero that runs off (N a visit)."""
    generator = np.random.default_rng(seed)
    places = np.stack([LENGTHS, 0 * LENGTHS], axis=1)
    each = nominal("kinematic", {1: (36.0, np.nan, 98.0, 4.77, 6.7)}, places, PRESSURES)
    table = pd.concat([each] * visits, ignore_index=True)
    table["time_s"] = 20.0 * np.arange(len(table))
    where = np.tile(np.repeat(generator.normal(0, OFF, len(LENGTHS)), len(PRESSURES)), visits)
    anew = np.repeat(generator.normal(0, again, visits * len(LENGTHS)), len(PRESSURES)) if again else 0 * where
    force = TRUE[2] * table["pressure_kpa"] * 1e3 - TRUE[0] * (table["elongation_mm"] + where + anew) * 1e-3
    force += drift * np.repeat(np.arange(visits), len(each)) + generator.normal(0, ACCURACY.force, len(table))
    moment = TRUE[3] * table["pressure_kpa"] * 1e3 + generator.normal(0, ACCURACY.moment, len(table))
    return Rows.from_table(table.assign(force_n=force, moment_nmm=moment * 1e3))


def true_fit(rows):
    model = springs([])
    return evaluated(model, rows, model.vector().detach() * 0 + torch.as_tensor(TRUE))


@pytest.mark.parametrize("seed", range(6))
def test_visits_that_are_off_alike_are_one_state(seed):
    rows = measured(seed)
    joined = joined_visits(true_fit(rows), rows)
    assert len(np.unique(rows.state)) == VISITS * len(LENGTHS)
    assert len(np.unique(joined.state)) == len(LENGTHS)
    # The visits are still known, of some rows too.
    assert (joined.visits == rows.state).all()
    some = torch.arange(0, len(rows), 3)
    assert (joined[some].visits == rows.state[::3]).all()
    for own in (joined.states.length[joined.state == n] for n in np.unique(joined.state)):
        assert len(own.unique()) == 1


def test_a_visit_is_one_place_though_its_length_creeps():
    rows = measured(3)
    # By 0.02 mm from row to row of each visit, as a carriage does under a load that grows.
    crept = 2e-5 * (torch.arange(len(rows)) % len(PRESSURES))
    moved = replace(rows, states=rows.states.replace(length=rows.states.length + crept))
    assert (joined_visits(true_fit(rows), moved).state == joined_visits(true_fit(rows), rows).state).all()


@pytest.mark.parametrize("change", [{"again": OFF}, {"drift": 0.1}], ids=["set anew", "drift"])
def test_visits_that_differ_stay_states_of_their_own(change):
    """0.06 N from visit to visit beside 0.03 N of a reading; a zero that drifts is to be found, not shared."""
    rows = measured(1, **change)
    assert joined_visits(true_fit(rows), rows) is rows


def test_rows_of_places_that_do_not_come_again_stay_as_they_are():
    rows = measured(2, visits=1)
    assert joined_visits(true_fit(rows), rows) is rows


def test_places_that_are_off_alike_at_each_visit_are_nothing_systematic():
    """Taken for errors of each visit they were: the same three times is no accident."""
    for seed in range(3):
        rows = measured(seed)
        prepared, fit, noise = prepare(Question(springs, [], rows, ACCURACY, 0))
        whiten = noise.whitener()
        assert len(np.unique(prepared.rows.state)) == len(LENGTHS)
        assert not prepared.step(fit, whiten).left.shows
        # Held out together: what one visit of a place teaches of it would predict the others.
        assert all(len(np.unique(prepared.fold[prepared.rows.state == n])) == 1 for n in np.unique(prepared.rows.state))
