"""How well the bed measured, judged from the data: from repeats, from the smooth part, with slips and heavy tails."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, LinearBed, bench, measured, normal, student
from scipy import stats

from freelearn.data.accuracy import Accuracy
from freelearn.discovery.fits.estimated_accuracy import (
    NEIGHBORS,
    REPEATS,
    SMOOTH,
    estimate,
    neighbor_scatter,
    repeat_scale,
    repeats,
)
from freelearn.discovery.fits.white_fit import evaluated
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.testing.reference.laboratory import KINDS


def judged(made, stated=ACCURACY):
    """Accuracy as estimated about the true numbers, as shares of the true ones, (length, twist, force, moment)."""
    model = LinearBed(stiffness=TRUE[0], torsion=TRUE[1], area=TRUE[2], turn=TRUE[3])
    fit = evaluated(model, made.rows, model.vector().detach())
    found, how = estimate(fit, made.rows, stated)
    return np.array([found.length / 3e-5, found.twist / 5e-3, *(np.array([found.force, found.moment]) / NOISE)]), (how)


def twice(seed, **how):
    """Every state of a short protocol measured twice, in a second round."""
    table = bench(seed, **SHORT).table
    rounds = pd.concat([own for _, own in table.groupby("sample") for own in (own, own)], ignore_index=True)
    return measured(rounds.assign(time_s=20.0 * np.arange(len(rounds))), seed, **how)


def wrong(s, loads):
    """What the model lacks: a hundred standard deviations, neither smooth nor small."""
    shape = torch.sign(torch.sin(5 * s.twist)) * s.pressure / 7e4
    return loads + 100 * NOISE * shape.numpy()[:, None]


# Of the median of n absolute differences of normal errors: 1.166 σ/√n. The two readings of a pair differ from their
# mean by the same, so that of 480 readings 240 count.
MEDIAN = 1.166 / np.sqrt(240)


@pytest.mark.parametrize("extra", [None, wrong], ids=["right", "wrong"])
def test_repeats_tell_the_sensors_errors_whatever_the_model_lacks(extra):
    found = []
    for seed in range(5):
        share, how = judged(twice(seed, extra=extra))
        assert how == REPEATS
        np.testing.assert_allclose(share[2:], 1, atol=4 * MEDIAN)
        found.append(share)
    np.testing.assert_allclose(np.mean(found, axis=0)[2:], 1, atol=4 * MEDIAN / np.sqrt(5))


def test_what_the_model_lacks_changes_nothing_of_what_repeats_tell():
    for seed in range(3):
        np.testing.assert_allclose(judged(twice(seed))[0], judged(twice(seed, extra=wrong))[0], rtol=1e-9)


def test_repeats_tell_position_errors():
    """48 visits twice, of which 96 numbers are independent, to be told in a mean of eight beds: 4 × 1.166/√768. The
    forces of one position error are twice a reading's noise, the moments less than half of it."""
    found = [judged(twice(seed))[0][:2] for seed in range(8)]
    np.testing.assert_allclose(np.mean(found, axis=0), 1, atol=4 * 1.166 / np.sqrt(768))


def test_a_bed_without_position_errors_is_not_given_any():
    """What a fit to five rows of noise moves is no position error: its own scatter has to be taken off."""
    true = Accuracy(0.0, 0.0, 150.0, 0.03, 6e-4)
    for seed in range(3):
        share, _ = judged(twice(seed, true=true))
        assert share[:2].max() < 0.3
        np.testing.assert_allclose(share[2:], 1, atol=4 * MEDIAN)


def test_heavy_tails_hardly_move_what_repeats_tell():
    """Of differences of two errors of Student's t the median is a smaller share of the standard deviation."""
    freedom = 4.0
    generator = np.random.default_rng(0)
    differences = student(freedom)(generator, (2, 400_000))
    share = 1.4826 * np.median(np.abs(differences[0] - differences[1])) / np.sqrt(2)
    assert 0.8 < share < 1
    assert 1.4826 * stats.t.ppf(0.75, freedom) / stats.t.std(freedom) < share
    for seed in range(5):
        found = judged(twice(seed, noise=student(freedom), extra=wrong))[0][2:]
        assert (found > share - 4 * MEDIAN).all()
        assert (found < 1 + 4 * MEDIAN).all()


def test_a_few_slips_do_not_decide_what_repeats_tell():
    """Three of a hundred rows: with the rows that they are compared with, and the position errors of both visits, a
    quarter of all visits. A mean of squares would be tens of times too large."""
    made, truth = twice(2).slipped(0.03, tuple(KINDS), 2)
    found, right = judged(made)[0][2:], judged(twice(2))[0][2:]
    np.testing.assert_allclose(found, right, rtol=0.25)
    for load in (0, 1):
        own = truth[truth["column"] == load]
        assert np.sqrt((own["sensor_sigmas"] ** 2).sum() / 480) > 5


def smooth(s, loads):
    x, y, p = (s.length - s.reference_length) / 5e-3, s.twist / 2, s.pressure / 7e4
    return loads + 10 * NOISE * torch.stack([y**2 * p, torch.sin(2 * y + x)], dim=-1).numpy()


@pytest.mark.parametrize("freedom", [np.inf, 4.0], ids=["normal", "heavy"])
@pytest.mark.parametrize("share", [0.0, 0.03], ids=["clean", "slipped"])
@pytest.mark.parametrize("stated", [1 / 3, 1, 3])
def test_without_repeats_the_scatter_about_what_is_smooth_tells(freedom, share, stated):
    """4 standard errors of a scale from 420 readings, of which shapes take a third; of heavy tails less information."""
    made = bench(4, extra=smooth, noise=normal if np.isinf(freedom) else student(freedom))
    if share:
        made, _ = made.slipped(share, tuple(KINDS), 4)
    like = Accuracy(*(stated * value for value in vars(ACCURACY).values()))
    found, how = judged(made, like)
    assert how == SMOOTH
    information = 1.0 if np.isinf(freedom) else freedom / (freedom + 3)
    np.testing.assert_allclose(found[2:], 1, atol=4 / np.sqrt(2 * 420 * information * 2 / 3))
    # Positions share their states with bins: the order of magnitude.
    assert 0.4 < found[0] < 1.6
    assert found[0] == pytest.approx(found[1])


def test_the_scale_between_repeats_leaves_slips_out():
    made, _ = twice(5, true=Accuracy(3e-5, 5e-3, 150.0, 0.09, 1.8e-3)).slipped(0.03, ("sign", "decimal"), 5)
    prepared, step = first_step(made.question())
    rows = prepared.rows
    scale = repeat_scale(step.fit.raw_residual, rows, step.whiten)
    # 3 times the sensors' noise, in units of all noise, the pressure's 15 mN and the place's 60 mN with it.
    stated = Whitener(sensitivities(step.fit.model, rows.states), torch.as_tensor(rows.state), ACCURACY)
    truth = np.array([0.09, 1.8e-3]) ** 2 - np.array([0.03, 6e-4]) ** 2
    expected = np.sqrt((1 + truth / stated.variance.mean(0).numpy()).mean())
    assert scale == pytest.approx(expected, rel=4 / np.sqrt(2 * 240) + 0.05)
    assert repeat_scale(step.fit.raw_residual, rows, stated) > 2 * scale


def test_a_repeat_is_another_visit_of_the_same_place():
    made = twice(0)
    places = made.table[["sample", "elongation_mm", "twist_deg", "pressure_kpa"]].round(6)
    groups = repeats(places, made.state)
    # A place is its state and pressure: each of a state's four rising and one falling pressures is met, twice.
    assert {len(group) for group in groups} == {2}
    for one, other in groups:
        assert made.state[one] != made.state[other]
        assert (places.iloc[one] == places.iloc[other]).all()
    assert len(repeats(places.iloc[:120], made.state[:120])) == 0


def test_repeats_that_are_the_same_to_the_last_digit_shown_err_by_its_rounding():
    """Most repeats then do not differ at all: their median is zero, and nothing may be divided by it."""
    made = twice(0, true=Accuracy(0.0, 0.0, 0.0, 1e-12, 1e-12))
    model = LinearBed(stiffness=TRUE[0], torsion=TRUE[1], area=TRUE[2], turn=TRUE[3])
    digit = torch.tensor([0.5, 0.01], dtype=torch.float64)
    value = (made.rows.loads / digit).round() * digit
    rows = dataclasses.replace(made.rows, readings=dataclasses.replace(made.rows.readings, value=value))
    found, how = estimate(evaluated(model, rows, model.vector().detach()), rows, ACCURACY)
    assert how == REPEATS
    np.testing.assert_allclose([found.force, found.moment], digit / 12**0.5, rtol=1e-6)
    assert found.length == found.twist == 0


def test_neighbors_tell_the_sensors_errors_beside_a_misfit_a_thousand_times_as_large():
    """Of a parabola along the pressure, another one in every visit, third differences know nothing; slips are few."""
    generator = np.random.default_rng(4)
    made = bench(1, states=40, pressures=9, falling=0)
    states = made.rows.states
    x = states.pressure.numpy() / 7e4
    size = generator.normal(0, 1000, (2, 3, states.length.unique().numel() * 50))
    visit = np.unique(made.rows.state, return_inverse=True)[1]
    misfit = np.stack([size[c, 0][visit] + size[c, 1][visit] * x + size[c, 2][visit] * x**2 for c in (0, 1)], axis=1)
    noise = generator.normal(size=misfit.shape)
    noise[generator.random(len(noise)) < 0.02] += 300
    found = neighbor_scatter(torch.as_tensor(NOISE * (misfit + noise)), made.rows)
    # Of 240 groups that overlap about 80 are independent.
    np.testing.assert_allclose(found.numpy() / NOISE, 1, atol=4 * 1.166 / np.sqrt(80))


def test_what_a_model_lacks_is_not_taken_for_scatter_where_neighbors_agree():
    """Few states bear no smooth shapes: a misfit of many sizes of the noise would pass for it."""

    def bends(s, loads):
        return loads + 30 * NOISE * np.sin(s.pressure.numpy() / 2e4)[:, None] * np.sign(s.twist.numpy())[:, None]

    made = bench(2, states=5, pressures=15, falling=0, extra=bends)
    share, how = judged(made)
    assert how in (SMOOTH, NEIGHBORS)
    # A bend leaves third differences a little: no more than twice the noise.
    assert share[2:].max() < 2


def test_few_neighbors_tell_nothing():
    made = bench(3, states=6, pressures=3, falling=0)
    assert bool(neighbor_scatter(torch.zeros(len(made.rows), 2, dtype=torch.float64), made.rows).isnan().all())


def test_of_readings_without_noise_an_accuracy_is_left_that_can_be_divided_by():
    made = bench(2, states=6, pressures=9, falling=0)
    model = LinearBed(stiffness=TRUE[0], torsion=TRUE[1], area=TRUE[2], turn=TRUE[3])
    with torch.no_grad():
        exact = model(made.rows.states).loads
    rows = dataclasses.replace(made.rows, readings=dataclasses.replace(made.rows.readings, value=exact))
    found, _ = estimate(evaluated(model, rows, model.vector().detach()), rows, ACCURACY)
    assert found.force > 0
    assert found.moment > 0
