"""Sorted by an input, time and that input go together: it is said, and the state that would tell is proposed."""

import numpy as np
import pandas as pd
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, bench, measured
from nightly import usually

from freelearn.discovery.fits.derivatives import none_vector
from freelearn.discovery.fits.white_fit import white_fit
from freelearn.discovery.search import measuring_order as order_module
from freelearn.discovery.search.measuring_order import (
    DRIFT,
    confounded,
    hinges,
    inputs,
    sortedness,
    telling_repeat,
    unknown,
)
from freelearn.discovery.search.search import search
from freelearn.records.discovery import classes_of, verdict_in_words

CANDIDATES = [DRIFT, "friction_hysteresis", "force_offset"]
# From end to end of a run in standard deviations of a reading.
SIGMAS = 8.0


def drift(s, loads):
    return loads + SIGMAS * NOISE * (s.clock / s.clock.max()).numpy()[:, None]


def searched(seed, order, extra=drift):
    made = bench(seed, **SHORT, order=order, extra=extra)
    return made, search(made.question(CANDIDATES))


@pytest.mark.parametrize("seed", usually(0, nightly=[1, 2]))
def test_in_order_of_elongation_a_drift_may_be_something_else(seed):
    _, findings = searched(seed, "sorted")
    assert findings.effects == [DRIFT]
    assert findings.sorted_by == ["elongation"]
    assert findings.verdict == "class"
    assert classes_of(findings) == [[DRIFT, unknown("elongation")]]
    assert f"{DRIFT} or unknown function of elongation" in verdict_in_words(findings, classes_of(findings))


@pytest.mark.parametrize("seed", usually(0, nightly=[1, 2]))
def test_in_random_order_a_drift_is_one(seed):
    _, findings = searched(seed, "random")
    assert (findings.verdict, findings.effects, findings.sorted_by) == ("named", [DRIFT], [])
    assert classes_of(findings) == [[DRIFT]]


def test_in_order_without_a_drift_there_is_nothing_to_say():
    _, findings = searched(0, "sorted", extra=None)
    assert (findings.verdict, findings.sorted_by) == ("adequate", [])

    def friction(s, loads):
        return loads - 10 * NOISE * s.direction.numpy()[:, None]

    _, findings = searched(0, "sorted", extra=friction)
    assert (findings.verdict, findings.effects, findings.sorted_by) == ("named", ["friction_hysteresis"], [])


def test_the_repeat_that_would_tell_is_the_state_measured_first():
    made, findings = searched(1, "sorted")
    proposed = telling_repeat(findings.final, findings.rows, "elongation", ACCURACY)
    assert proposed.separates == [DRIFT, unknown("elongation")]
    own = made.table[made.table["sample"] == proposed.sample]
    first = own.iloc[0]
    assert (proposed.elongation_mm, proposed.twist_deg, proposed.pressure_kpa) == pytest.approx(
        (first["elongation_mm"], first["twist_deg"], first["pressure_kpa"])
    )
    # Sorted, that is the shortest.
    assert first["elongation_mm"] == own["elongation_mm"].min()
    # A drift of 8 σ in either load, of the sensors' own noise: √(8² + 8²) in units of those.
    expected = SIGMAS * np.hypot(*(NOISE / [ACCURACY.force, ACCURACY.moment]))
    # A rate from 48 states whose means scatter by less than two standard deviations each.
    assert proposed.expected_z == pytest.approx(expected, abs=4 * 2 * np.sqrt(12 / 48) * np.sqrt(2))


def test_what_a_repeat_shows_settles_it(monkeypatch):
    """The first state of either sample once more at the end: a function of elongation cannot explain the two visits'
    difference, the drift's 8 σ of five rows each, however little order is asked for."""
    monkeypatch.setattr(order_module, "SORTED", 0.5)
    parts = []
    for _, own in bench(1, **SHORT, order="sorted").table.groupby("sample"):
        again = own.iloc[:5]
        parts += [own, again.assign(time_s=again["time_s"] + own["time_s"].max() + 60)]
    findings = search(measured(pd.concat(parts, ignore_index=True), 1, extra=drift).question(CANDIDATES))
    states = findings.rows.states
    assert sortedness(states, inputs(states)["elongation"]) > 0.6
    assert (findings.verdict, findings.effects, findings.sorted_by) == ("named", [DRIFT], [])


@pytest.mark.parametrize(("order", "expected"), [("sorted", ["elongation"]), ("random", [])])
def test_a_function_that_explains_more_by_chance_alone_is_no_rival_in_random_order(order, expected):
    """Without any drift its two rates take 2 of χ², and six hinges of two loads and two samples 20 and more."""
    prepared, first = first_step(bench(3, **SHORT, order=order).question([DRIFT]))
    model = prepared.question.build([DRIFT])
    fit = white_fit(model, prepared.rows, first.whiten, none_vector(model, first.fit))
    assert confounded(prepared, prepared.step(fit, first.whiten)) == expected
    assert confounded(prepared, first) == []


def test_sortedness_is_the_share_of_the_clock_that_an_input_explains():
    """0.8 is what counts as sorted. By chance six hinges explain 5/23 of 24 states' clock."""
    for order, low, high in (("sorted", 0.95, 1.0), ("random", 0.0, 0.6)):
        states = bench(3, **SHORT, order=order).rows.states
        share = sortedness(states, inputs(states)["elongation"])
        assert low <= share <= high
    states = bench(3, **SHORT, order="sorted").rows.states
    # Twist is gone through once more at every elongation.
    assert sortedness(states, inputs(states)["twist"]) < 0.6


def test_hinges_are_continuous_and_hold_straight_lines_and_constants():
    x = torch.linspace(-3, 5, 200, dtype=torch.float64)
    columns = hinges(x)
    assert torch.linalg.matrix_rank(columns) == columns.shape[1]
    for target in (torch.ones_like(x), 2 * x - 1):
        best = torch.linalg.lstsq(columns, target[:, None]).solution
        torch.testing.assert_close((columns @ best)[:, 0], target)
    # No step from one point to the next is more than a slope's.
    assert float(columns.diff(dim=0).abs().max()) <= 2 * float(x.diff().max()) / 8 * 2
