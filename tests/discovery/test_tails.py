"""Student's t against SciPy's, and its estimate from errors of which the truth is known."""

import numpy as np
import pytest
from scipy import integrate, stats
from scipy.special import digamma, polygamma

from freelearn.discovery.noise.tails import FREEDOMS, SPREAD, Tails, fitted

FINITE = [freedom for freedom in FREEDOMS if np.isfinite(freedom)]
Z = np.r_[-30.0, -3.0, -0.5, 0.1, 1.0, 4.0, 12.0]


def score(z, freedom):
    """Slope of the log-density, by SciPy and central differences."""
    return (stats.t.logpdf(z + 1e-5, freedom) - stats.t.logpdf(z - 1e-5, freedom)) / 2e-5


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_density_and_deviation_are_those_of_scipy(freedom):
    tails = Tails(freedom)
    np.testing.assert_allclose(tails.log_density(Z), stats.t.logpdf(Z, freedom), rtol=1e-10)
    assert tails.deviation == pytest.approx(stats.t.std(freedom))


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_weights_are_the_slope_of_the_likelihood(freedom):
    np.testing.assert_allclose(Tails(freedom).weight(Z), -score(Z, freedom) / Z, rtol=1e-5)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_efficiency_is_fishers_information(freedom):
    information = integrate.quad(lambda z: score(z, freedom) ** 2 * stats.t.pdf(z, freedom), -np.inf, np.inf)[0]
    assert Tails(freedom).efficiency == pytest.approx(information, rel=1e-6)


@pytest.mark.parametrize("freedom", FINITE)
def test_influence_is_bounded(freedom):
    tails, z = Tails(freedom), np.linspace(0, 1e4, 200001)
    # The influence z (ν + 1)/(ν + z²) is largest at z = √ν.
    assert (z * tails.weight(z)).max() <= (freedom + 1) / (2 * freedom**0.5) + 1e-12


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_a_good_reading_is_seldom_pointed_out(freedom):
    tails = Tails(freedom)
    assert 2 * stats.t.sf(tails.limit, freedom) <= 4e-4 * (1 + 1e-9)
    assert tails.limit >= 5 * stats.t.std(freedom)


def test_the_chance_of_a_good_reading_is_the_share_of_good_ones():
    generator, count, share = np.random.default_rng(0), 400_000, 0.05
    slipped = generator.random(count) < share
    z = np.where(slipped, generator.uniform(-SPREAD / 2, SPREAD / 2, count), generator.normal(size=count))
    chance = Tails(slipped=share).good(z)
    for low, high in ((0.0, 0.5), (0.5, 0.9), (0.9, 0.999), (0.999, 1.0)):
        inside = (chance > low) & (chance <= high)
        expected = chance[inside].mean()
        error = np.sqrt(expected * (1 - expected) / inside.sum())
        assert (~slipped[inside]).mean() == pytest.approx(expected, abs=4 * error)


def asymptotic(freedom: float, count: int) -> np.ndarray:
    """Standard errors of ln(scale) and of the freedom by maximum likelihood of both (Lange, Little & Taylor 1989)."""
    v = freedom
    by_freedom = (polygamma(1, v / 2) - polygamma(1, (v + 1) / 2)) / 4 - (v + 5) / (2 * v * (v + 1) * (v + 3))
    both = -2 / ((v + 1) * (v + 3))
    information = np.array([[2 * v / (v + 3), both], [both, by_freedom]])
    return np.sqrt(np.diag(np.linalg.inv(information)) / count)


def test_the_asymptotic_errors_used_here_are_those_of_the_score():
    """The formulas of the line above against a mean over the distribution."""
    v = 5.0

    def slopes(z):
        by_scale = (v + 1) * z**2 / (v + z**2) - 1
        by_freedom = (
            digamma((v + 1) / 2) - digamma(v / 2) - 1 / v - np.log1p(z**2 / v) + (v + 1) * z**2 / (v * (v + z**2))
        ) / 2
        return np.array([by_scale, by_freedom])

    z = np.linspace(-300, 300, 600_001)
    information = (slopes(z) * stats.t.pdf(z, v)) @ slopes(z).T * (z[1] - z[0])
    np.testing.assert_allclose(asymptotic(v, 1), np.sqrt(np.diag(np.linalg.inv(information))), rtol=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.02])
@pytest.mark.parametrize("freedom", [3.0, 5.0])
def test_freedom_scale_and_slips_are_recovered(freedom, share):
    generator, count, scale = np.random.default_rng([int(freedom), 1]), 6000, 0.37
    slipped = generator.random(count) < share
    z = scale * np.where(slipped, generator.uniform(-400, 400, count), generator.standard_t(freedom, count))
    tails, found = fitted(z, Tails())
    errors = asymptotic(freedom, count)
    # The freedom is one of a few: it may be off by half of a step more.
    steps = np.diff(1 / np.array(FREEDOMS))
    assert abs(1 / tails.freedom - 1 / freedom) < 4 * errors[1] / freedom**2 + np.abs(steps).max() / 2
    assert abs(np.log(found / scale)) < 4 * errors[0] + 0.02
    # A slip of less than a dozen scales is one of the heavy tail's own.
    assert tails.slipped == pytest.approx(slipped.mean(), abs=4 * np.sqrt(share / count) + share * 12 / 400 + 1 / count)


def test_normal_errors_stay_normal():
    """Twice the gain in log-likelihood is χ² with one degree half of the time, and zero else (Self & Liang 1987):
    beyond 4 in 2.3 % of all cases, so in more than 9 of 100 with a chance of one in ten thousand."""
    heavy, scales, shares = 0, [], []
    for seed in range(100):
        tails, scale = fitted(np.random.default_rng(seed).normal(size=400), Tails())
        heavy += np.isfinite(tails.freedom)
        scales.append(scale * tails.deviation)
        shares.append(tails.slipped)
    assert heavy <= 9
    # Of the mean of 100 standard deviations of 400 numbers each.
    assert np.mean(scales) == pytest.approx(1, abs=4 / np.sqrt(2 * 400 * 100))
    assert max(shares) < 1 / 400


def test_without_slips_it_is_the_fit_of_scipy():
    z = 2.5 * np.random.default_rng(7).standard_t(4, 3000)
    tails, scale = fitted(z, Tails())
    likelihoods = {}
    for freedom in FREEDOMS:
        _, _, best = (0, 0, z.std()) if np.isinf(freedom) else stats.t.fit(z, fdf=freedom, floc=0)
        likelihoods[freedom] = stats.t.logpdf(z / best, freedom).sum() - len(z) * np.log(best)
    assert tails.freedom == max(likelihoods, key=likelihoods.get)
    # What is left are the slips that it must think possible, half a reading of 3,000.
    assert scale == pytest.approx(stats.t.fit(z, fdf=tails.freedom, floc=0)[2], rel=1e-3)


def test_slips_beside_normal_errors_make_no_heavy_tails():
    """A reading at 30 σ is one that slipped; a t with 3 degrees of freedom would widen every other's error for it."""
    z = np.random.default_rng(3).normal(size=2000)
    z[:20] = np.linspace(15, 300, 20)
    tails, scale = fitted(z, Tails())
    assert np.isinf(tails.freedom)
    assert scale == pytest.approx(1, abs=4 / np.sqrt(2 * 2000))
    assert tails.slipped == pytest.approx(0.01, abs=1 / 2000)
    assert (tails.good(z / scale)[:20] < 1e-6).all()
