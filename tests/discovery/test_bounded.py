"""Bounded least squares against SciPy's, draw by draw."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from freelearn.discovery.noise.linear_algebra import MOST_FACES, bounded_least_squares

INFINITE = np.inf


def brute(design, targets, low, high):
    """Reduction of ‖A x − y‖² by lsq_linear, one target at a time."""
    gains = []
    for target in targets:
        best = lsq_linear(design, target, (low, high), tol=1e-14)
        gains.append(target @ target - 2 * best.cost)
    return np.array(gains)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ([-INFINITE], [INFINITE]),
        ([0.0], [INFINITE]),
        ([-INFINITE], [0.0]),
        ([0.0, 0.0], [INFINITE, INFINITE]),
        ([0.0, -INFINITE], [INFINITE, INFINITE]),
        ([0.0, -INFINITE, -INFINITE], [INFINITE, 0.0, INFINITE]),
        ([0.0] * (MOST_FACES + 1) + [-INFINITE], [INFINITE] * (MOST_FACES + 2)),
    ],
)
def test_every_draw_is_the_bounded_minimum(low, high):
    low, high = np.array(low), np.array(high)
    generator = np.random.default_rng(len(low))
    design = generator.normal(size=(40, len(low))) + 2 * generator.normal(size=(40, 1))
    targets = generator.normal(size=(60, 40)) * 3
    x, gain = bounded_least_squares(design.T @ design, targets @ design, low, high)
    np.testing.assert_allclose(gain, brute(design, targets, low, high), rtol=1e-6, atol=1e-8)
    assert (x >= low).all()
    assert (x <= high).all()
    np.testing.assert_allclose(gain, (targets**2).sum(1) - ((targets - x @ design.T) ** 2).sum(1), atol=1e-8)


def test_two_correlated_bounded_parameters_keep_the_null_where_it_belongs():
    # Clipping the slopes before solving, as if the parameters were independent, makes this quantile 33.
    generator = np.random.default_rng(0)
    one = generator.normal(size=200)
    design = np.stack([one, -one + 0.3 * generator.normal(size=200)], axis=1)
    targets = generator.normal(size=(999, 200))
    gram, slopes = design.T @ design, targets @ design
    low, high = np.zeros(2), np.full(2, INFINITE)
    _, gain = bounded_least_squares(gram, slopes, low, high)
    quantile = np.quantile(gain, 0.99)
    assert quantile == pytest.approx(np.quantile(brute(design, targets, low, high), 0.99), rel=1e-6)
    assert quantile < 12
    clipped = np.maximum(slopes, 0)
    assert np.quantile((clipped * np.linalg.solve(gram, clipped.T).T).sum(1), 0.99) > 2 * quantile


@pytest.mark.filterwarnings("error")
def test_an_unknown_of_which_rounding_leaves_less_than_nothing_stays_where_it_is():
    gram, slopes = np.array([[4.0, 0.0], [0.0, -1e-18]]), np.array([[6.0, 0.0]])
    x, gain = bounded_least_squares(gram, slopes, np.array([0.0, -INFINITE]), np.full(2, INFINITE))
    np.testing.assert_allclose(x, [[1.5, 0.0]])
    np.testing.assert_allclose(gain, [9.0])
