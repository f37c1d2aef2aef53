"""What two effects promise together, beside the probability of the residuals themselves."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from freelearn.discovery.search.pairs import Pairs

ROWS, PLACES = 40, {"a": slice(0, 1), "b": slice(1, 3), "c": slice(3, 4), "d": slice(4, 5)}
ODDS = {"a": -1.0, "b": -2.0, "c": 0.0, "d": -0.5}


@pytest.fixture
def linear():
    """Five columns, of which the second effect has two, residuals of noise 1 that three of them make, and the priors of
    their coefficients."""
    random = np.random.default_rng(3)
    columns, sizes = random.normal(size=(ROWS, 5)), np.array([1.0, 0.5, 2.0, 1.0, 3.0])
    measured = columns @ np.array([1.0, 0.0, -1.0, 0.6, 0.0]) + random.normal(size=ROWS)
    return columns, measured, np.diag(sizes**2)


def pairs(columns, measured, prior) -> Pairs:
    """Beside a fit of two parameters, of which the first gives way to each coefficient by a tenth."""
    free, given = np.full(5, np.inf), np.outer([0.1, 0.0], np.ones(5))
    labels = ("a", "b.first", "b.second", "c", "d")
    gram, slope = columns.T @ columns, columns.T @ measured
    return Pairs(PLACES, ODDS, labels, ("C1", "C2"), given, gram, slope, -free, free, prior)


def test_it_is_the_rise_of_the_probability_of_the_residuals(linear):
    columns, measured, prior = linear

    def density(own):
        wide = columns[:, own] @ prior[np.ix_(own, own)] @ columns[:, own].T
        return multivariate_normal(np.zeros(ROWS), np.eye(ROWS) + wide).logpdf(measured)

    expected = {}
    for one, other in combinations(PLACES, 2):
        own = [k for name in (one, other) for k in range(5)[PLACES[name]]]
        expected[one, other] = density(own) - density([]) + ODDS[one] + ODDS[other]
    found = pairs(*linear).best(6)
    assert {pair.names: pair.evidence for pair in found} == pytest.approx(expected)
    assert [pair.names for pair in found] == sorted(expected, key=lambda names: -expected[names])
    assert pairs(*linear).best(2) == found[:2]
    assert pairs(*linear).best(6, without=["b"]) == [pair for pair in found if "b" not in pair.names]
    assert pairs(*linear).best(6, without=["a", "b", "c"]) == []


def test_it_moves_to_the_most_probable_coefficients_and_the_fit_gives_way(linear):
    columns, measured, prior = linear
    (pair,) = (p for p in pairs(*linear).best(6) if p.names == ("b", "d"))
    own = [1, 2, 4]
    # Least squares with a row more for each coefficient, which its prior holds at zero.
    rows = np.vstack([columns[:, own], np.diag(1 / np.sqrt(np.diag(prior)[own]))])
    expected = np.linalg.lstsq(rows, np.append(measured, np.zeros(3)))[0]
    assert [pair.moved[label] for label in ("b.first", "b.second", "d")] == pytest.approx(expected)
    assert pair.moved["C1"] == pytest.approx(-0.1 * expected.sum())
    assert pair.moved["C2"] == 0


def test_what_bounds_forbid_promises_nothing(linear):
    free = pairs(*linear)
    # The second column of b would have to be negative.
    bound = replace(free, low=np.where(np.arange(5) == 2, 0.0, -np.inf))
    one, other = ({pair.names: pair.evidence for pair in each.best(6)} for each in (free, bound))
    assert all((other[names] < one[names] - 1) == ("b" in names) for names in one)
    assert bound.best(1)[0].names == ("a", "c")


def test_two_effects_that_do_the_same_have_an_answer_however_large_they_are(linear):
    columns, measured, _ = linear
    columns[:, 4] = columns[:, 0]
    for size in (1.0, 1e9):
        # Of the large ones what tells the two apart, their priors, is below the last digit of their products.
        found = {pair.names: pair.evidence for pair in pairs(size * columns, measured, np.eye(5)).best(6)}
        whole = 1 + 2 * size**2 * columns[:, 0] @ columns[:, 0]
        gain = 2 * size**2 * (columns[:, 0] @ measured) ** 2 / whole
        expected = 0.5 * gain - 0.5 * np.log(whole) + ODDS["a"] + ODDS["d"]
        if size == 1.0:
            assert found["a", "d"] == pytest.approx(expected)
        else:
            # No more than it can be.
            assert found["a", "d"] < expected
