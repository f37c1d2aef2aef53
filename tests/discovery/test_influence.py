"""No reading decides a fit, and where there is nothing to resist that costs next to nothing."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, bench, student

from freelearn.discovery.fits.left_out import HeldOut, paired
from freelearn.discovery.fits.step import parameter_covariance
from freelearn.discovery.fits.white_fit import white_fit
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.search.ranking import Ranking


def believing(prepared, step):
    """The same model fitted as if all noise were normal and as stated."""
    sensitivity = sensitivities(step.fit.model, prepared.rows.states)
    whiten = Whitener(sensitivity, torch.as_tensor(prepared.rows.state), ACCURACY)
    return white_fit(prepared.question.build([]), prepared.rows, whiten, step.fit.vector)


def both(seeds, **how):
    """Relative errors of the four numbers, (seeds, 4), by either fit; and standard errors as told, (seeds, 4)."""
    robust, plain, told = [], [], []
    for seed in seeds:
        made = bench(seed, **SHORT, **how)
        prepared, step = first_step(made.question())
        other = believing(prepared, step)
        robust.append(list(step.fit.values().values()))
        plain.append(list(other.values().values()))
        told.append(parameter_covariance(step).diagonal().sqrt().tolist())
    return np.array(robust) / TRUE - 1, np.array(plain) / TRUE - 1, np.array(told) / TRUE


@pytest.fixture(scope="module")
def clean():
    return both(range(20))


@pytest.mark.nightly
def test_with_nothing_to_resist_it_is_as_good_as_least_squares(clean):
    """95 % efficient: the variance may be larger by a factor 1/0.95, and by the error of a ratio of two variances from
    20 pairs, 2 √((1 − r²)/20), r the pairs' correlation."""
    robust, plain, _ = clean
    for one, other in zip(robust.T, plain.T, strict=True):
        correlation = (one @ other) / np.sqrt((one @ one) * (other @ other))
        error = 2 * np.sqrt((1 - correlation**2) / len(one))
        assert error < 0.05
        assert (one @ one) / (other @ other) < 1 / 0.95 + 3 * error


@pytest.mark.nightly
def test_standard_errors_are_those_of_the_estimates(clean):
    robust, _, told = clean
    # Mean square of 4 × 20 standardized errors, of which a fit's are correlated in pairs.
    assert ((robust / told) ** 2).mean() == pytest.approx(1, abs=4 * np.sqrt(2 / 40))


@pytest.mark.slow
@pytest.mark.nightly
def test_under_heavy_tails_it_is_better_than_least_squares():
    """Student's t with 4 degrees of freedom: 5/7 of a normal one's information, of a variance twice as large; the best
    fit's variance is 0.7 times that of least squares. Positions, of which there are few, gain less."""
    robust, plain, told = both(range(40), noise=student(4))
    gain = (robust**2).sum(0) / (plain**2).sum(0)
    # The piston's numbers rest on rows, not on states.
    assert gain[2:].mean() < 0.9
    assert gain.max() < 1.05
    assert ((robust / told) ** 2).mean() == pytest.approx(1, abs=4 * np.sqrt(2 / 80))


@pytest.fixture(scope="module")
def slipped():
    """Row 17's force is off by 40 standard deviations."""
    made = bench(2, **SHORT)
    asked = made.showing({(17, 0): made.loads[17, 0] + 40 * NOISE[0]}).question()
    prepared, step = first_step(asked)
    return made, prepared, step


def errors(step):
    return parameter_covariance(step).diagonal().sqrt()


def test_a_slipped_reading_may_be_anything(slipped):
    """Ten times as far off, in the same fit: less than a millionth of a standard error."""
    made, prepared, step = slipped
    rows = made.showing({(17, 0): made.loads[17, 0] + 400 * NOISE[0]}).rows
    fits = [white_fit(prepared.question.build([]), r, step.whiten, step.fit.vector) for r in (prepared.rows, rows)]
    assert float(((fits[0].vector - fits[1].vector) / errors(step)).abs().max()) < 1e-6
    # Least squares would follow it by several.
    plain = Whitener(sensitivities(step.fit.model, rows.states), torch.as_tensor(rows.state), ACCURACY)
    fits = [white_fit(prepared.question.build([]), r, plain, step.fit.vector) for r in (prepared.rows, rows)]
    assert float(((fits[0].vector - fits[1].vector) / errors(step)).abs().max()) > 3


@pytest.mark.parametrize("sigmas", [-40, 4e2, 4e4])
def test_from_the_start_it_may_be_anything_too(slipped, sigmas):
    """All rounds anew: a fit is pursued to a thousandth of a standard error (SETTLED), and so are both of these."""
    made, _, step = slipped
    _, other = first_step(made.showing({(17, 0): made.loads[17, 0] + sigmas * NOISE[0]}).question())
    assert float(((step.fit.vector - other.fit.vector) / errors(step)).abs().max()) < 4e-3
    assert torch.nonzero(other.whiten.scatter.slipped).tolist() == [[17, 0]]
    # It is neither in the error that is shown nor in the size of the loads which that is a share of.
    assert other.E_train == pytest.approx(step.E_train, rel=1e-3)
    assert other.E_heldout == pytest.approx(step.E_heldout, rel=1e-3)


def test_the_other_load_of_its_row_still_counts(slipped):
    _, _, step = slipped
    reading = step.whiten.scatter.reading
    assert float(reading[17, 0]) < 1e-12
    # Normal noise as stated: 1, and by the errors of the estimated size.
    assert float(reading[17, 1]) == pytest.approx(1, abs=0.25)


def test_no_promise_follows_a_slipped_reading(slipped):
    made, prepared, step = slipped
    names, asked = ["force_offset", "friction_hysteresis", "sensor_drift"], prepared.question

    def promises(rows):
        model = asked.build([])
        fit = white_fit(model, rows, step.whiten, step.fit.vector, asked.prior(model, prepared.spans))
        ranking = Ranking(fit, rows, step.whiten, names, asked.build, prepared.spans, {}, {})
        return {promise.effect: promise for promise in ranking.promises()}

    far = promises(made.showing({(17, 0): made.loads[17, 0] + 4e3 * NOISE[0]}).rows)
    for name, one in promises(prepared.rows).items():
        assert one.status == "tested"
        assert one.chi2 == pytest.approx(far[name].chi2, rel=1e-6)
        assert one.evidence == pytest.approx(far[name].evidence, abs=1e-6)


def test_no_held_out_loss_follows_it(slipped):
    made, prepared, step = slipped
    rows = made.showing({(17, 0): made.loads[17, 0] + 4e3 * NOISE[0]}).rows
    fit = white_fit(prepared.question.build([]), rows, step.whiten, step.fit.vector)
    other = replace(prepared, rows=rows).step(fit, step.whiten).heldout
    np.testing.assert_allclose(other.loss, step.heldout.loss, atol=1e-3)


def test_one_group_neither_makes_a_difference_nor_hides_one():
    """Forty kinematic states of which each speaks for the first model by 1 ± 0.5, and one says anything."""
    generator = np.random.default_rng(0)
    difference = 1 + 0.5 * generator.normal(size=40)
    nothing = 0.5 * generator.normal(size=40)

    def between(losses):
        return paired(HeldOut(None, None, np.zeros(40), None), HeldOut(None, None, losses, None))

    mean, error = between(difference)
    assert (mean, error) == pytest.approx((difference.mean(), difference.std(ddof=1) / 40**0.5))
    for wild in (1e3, -1e3, 1e9):
        mean, error = between(np.r_[difference[:-1], wild])
        assert mean > 2 * error
        mean, error = between(np.r_[nothing[:-1], wild])
        assert abs(mean) < 2 * error
