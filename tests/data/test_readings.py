"""Readings with blanks and censored rows: what counts, in which direction, and the error over what there is."""

import math

import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from freelearn.data.beds import BED, BEDS
from freelearn.data.error import set_error, usual_scale
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.testing.small_tables import random_table

ROWS = 12
# A gauge has a last digit: shares of a largest load of 1e-200 would overflow, here and in the error.
finite = st.floats(-100, 100).map(lambda load: round(load, 6))
loads = arrays(np.float64, (ROWS, 2), elements=finite)
marks = arrays(np.bool_, (ROWS, 2))


def readings(value, present, slack=None) -> Readings:
    loose = np.zeros(len(value), dtype=bool) if slack is None else slack
    return Readings(torch.as_tensor(np.where(present, value, 0.0)), torch.as_tensor(present), torch.as_tensor(loose))


@settings(max_examples=60, deadline=None)
@given(loads, loads, marks, arrays(np.bool_, ROWS))
def test_a_miss_is_what_the_words_say(value, predicted, present, slack):
    """Blank: nothing. Slack: a push (more force than shown) costs nothing, a pull counts in full."""
    missed = readings(value, present, slack).missed(torch.as_tensor(predicted)).numpy()
    for row in range(ROWS):
        for channel in (0, 1):
            expected = predicted[row, channel] - value[row, channel] if present[row, channel] else 0.0
            if channel == 0 and slack[row]:
                expected = min(expected, 0.0)
            assert missed[row, channel] == expected


@settings(max_examples=40, deadline=None)
@given(loads, loads, marks, arrays(np.bool_, ROWS))
def test_what_is_felt_is_the_derivative_of_the_miss(value, predicted, present, slack):
    told = readings(value, present, slack)
    # On the kink itself either side would do.
    predicted = np.where(np.abs(predicted - value) < 1e-6, predicted + 1.0, predicted)
    at = torch.as_tensor(predicted).requires_grad_()
    told.missed(at).sum().backward()
    assert torch.equal(at.grad.bool(), told.informative_mask(at.detach()))


@settings(max_examples=60, deadline=None)
@given(loads, loads, marks, arrays(np.bool_, ROWS))
def test_the_error_is_over_the_readings_that_there_are(value, predicted, present, usable):
    """The paper's metric, each quantity by its own largest value, written once more with plain loops."""
    rows = Rows(States.from_table(random_table(ROWS, 0)), readings(value, present), np.arange(ROWS))
    error = set_error(rows, torch.as_tensor(predicted), torch.as_tensor(usable))
    total, seen = 0.0, False
    for channel, name in enumerate(("force", "moment")):
        largest = max((abs(value[i, channel]) for i in range(ROWS) if present[i, channel]), default=0.0) or 1.0
        counted = [i for i in range(ROWS) if present[i, channel] and usable[i]]
        if not counted:
            assert math.isnan(error.part(name))
            continue
        mean = sum(((predicted[i, channel] - value[i, channel]) / largest) ** 2 for i in counted) / len(counted)
        assert error.part(name) == pytest.approx(math.sqrt(mean), rel=1e-12, abs=1e-300)
        total, seen = total + mean, True
    assert error.n == usable.sum()
    if seen:
        assert pytest.approx(math.sqrt(total), rel=1e-12, abs=1e-300) == error.E
    else:
        assert math.isnan(error.E)


def table_of(bed: str, **columns) -> pd.DataFrame:
    table = random_table(4, 1).assign(force_n=[1.0, 2.0, 3.0, 4.0], moment_nmm=[10.0, 20.0, 30.0, 40.0], **columns)
    return table if bed == "kinematic" else table.assign(**{BED: bed})


def test_a_table_says_what_is_blank():
    told = Readings.from_table(table_of("kinematic").assign(moment_nmm=[10.0, np.nan, np.nan, 40.0]))
    assert told.present.tolist() == [[True, True], [True, False], [True, False], [True, True]]
    assert told.value.tolist() == [[1.0, 0.01], [2.0, 0.0], [3.0, 0.0], [4.0, 0.04]]
    assert told.count == 6
    assert not told.plain


def test_an_isometric_bed_measures_no_moment_whatever_stands_there():
    told = Readings.from_table(table_of("isometric"))
    assert told.present.all(0).tolist() == [True, False]
    assert told.value[:, 1].tolist() == [0.0] * 4


def test_an_inflation_bed_shows_force_and_diameter_and_a_dead_load_the_place():
    shown = Readings.from_table(table_of("inflation", outer_diameter_mm=[13.0, 13.5, np.nan, 14.0]))
    np.testing.assert_allclose(shown.value[:, 1].tolist(), [0.013, 0.0135, 0.0, 0.014])
    assert shown.present[:, 1].tolist() == [True, True, False, True]
    place = Readings.from_table(table_of("dead_load").assign(elongation_mm=2.0, twist_deg=180.0))
    np.testing.assert_allclose(place.value.numpy(), np.tile([2e-3, np.pi], (4, 1)))


def test_a_tube_that_hangs_loose_tells_no_moment_and_shows_its_force():
    told = Readings.from_table(table_of("kinematic", slack=[0, 1, 0, 1]))
    assert told.slack.tolist() == [False, True, False, True]
    assert told.present.tolist() == [[True, True], [True, False], [True, True], [True, False]]


def test_under_a_dead_load_nothing_is_censored():
    told = Readings.from_table(table_of("dead_load", slack=[0, 1, 0, 1]))
    assert not told.slack.any()


def test_readings_of_rows_are_the_rows_readings():
    told = Readings.from_table(table_of("kinematic", slack=[0, 1, 0, 1]))
    some = told[torch.tensor([1, 2])]
    assert some.slack.tolist() == [True, False]
    assert torch.equal(some.value, told.value[1:3])


def test_the_usual_scale_looks_past_blanks():
    """Of eleven equal moments and any number of blanks: that moment, not a quantile of zeros."""
    value = np.tile([2.0, 5.0], (ROWS, 1))
    present = np.ones((ROWS, 2), dtype=bool)
    present[3:, 1] = False
    assert usual_scale(readings(value, present)).tolist() == [2.0, 5.0]
    present[:, 1] = False
    assert usual_scale(readings(value, present)).tolist() == [2.0, 1.0]


@pytest.mark.parametrize("bed", BEDS)
def test_what_a_bed_imposes_and_reads_are_five_different_quantities_at_most(bed):
    quantities = [*BEDS[bed].imposed, *BEDS[bed].measured]
    assert len({q.column for q in quantities}) == len(quantities)
    assert set(BEDS[bed].measured) <= set(BEDS[bed].readings)
