"""Designs whose optimum is in every textbook."""

import numpy as np
import pytest

from freelearn.queries.next_measurements.continuous_plan import continuous
from freelearn.queries.next_measurements.exact_plan import choose, exact
from freelearn.queries.next_measurements.views import InformationMatrix, Objective, Visits

X = np.linspace(-1, 1, 101)
ROOT = float(np.sqrt(1 / 5))
PLACES = np.array([-1, -0.75, -0.5, -ROOT, -0.25, 0, 0.25, ROOT, 0.5, 0.75, 1])


def regression(degree: int, interest: int, keep: float = 1e-9) -> Objective:
    """A polynomial of this degree on [−1, 1], each row a mounting; of interest: the coefficients of the highest."""
    columns = np.zeros((len(X), 1, 2, degree + 1))
    columns[:, 0, 0] = X[:, None] ** np.arange(degree + 1)
    visits = Visits.from_masks(np.zeros((len(X), 1, 2, 2)), np.ones((len(X), 1), dtype=bool))
    return Objective(visits, [InformationMatrix(("y",), columns, keep * np.eye(degree + 1), interest)])


def shares(objective: Objective, rows: int) -> dict[float, float]:
    found = continuous(objective, rows, rows)
    near: dict[float, float] = {}
    for visit, weight in zip(found.visits, found.weights, strict=True):
        # Between two places of the grid the optimum falls to both.
        place = float(PLACES[np.abs(PLACES - X[visit]).argmin()])
        near[place] = near.get(place, 0.0) + weight / rows
    return {x: share for x, share in near.items() if share > 0.01}


def test_a_straight_line_is_measured_at_its_ends():
    assert shares(regression(1, 1), 10) == pytest.approx({-1.0: 0.5, 1.0: 0.5}, abs=0.01)
    assert shares(regression(1, 2), 10) == pytest.approx({-1.0: 0.5, 1.0: 0.5}, abs=0.01)


def test_a_parabola_is_measured_at_its_ends_and_in_the_middle():
    # Kiefer & Wolfowitz 1959: a third each for all three coefficients; for the curvature alone a half in the middle.
    assert shares(regression(2, 3), 12) == pytest.approx({-1.0: 1 / 3, 0.0: 1 / 3, 1.0: 1 / 3}, abs=0.01)
    assert shares(regression(2, 1), 12) == pytest.approx({-1.0: 0.25, 0.0: 0.5, 1.0: 0.25}, abs=0.01)


def test_a_cubic_is_measured_at_the_zeros_of_legendres_derivative():
    # Guest 1958: for all coefficients ±1 and ±1/√5, a quarter each; for the highest alone Chebyshev's points.
    found = shares(regression(3, 4), 8)
    assert found == pytest.approx({-1.0: 0.25, -ROOT: 0.25, ROOT: 0.25, 1.0: 0.25}, abs=0.02)
    assert set(shares(regression(3, 1), 12)) == {-1.0, -0.5, 0.5, 1.0}


def test_whole_rows_take_the_shares_where_they_divide():
    objective = regression(2, 1)
    plan = exact(objective, continuous(objective, 12, 12), 12, 12, seed=0)
    places, counts = np.unique(X[plan].round(6), return_counts=True)
    assert dict(zip(places, counts, strict=True)) == {-1.0: 3, 0.0: 6, 1.0: 3}


def test_rows_that_are_measured_already_count():
    # The left end is known a thousand times over: the slope needs rows at the right end alone.
    objective = regression(1, 1)
    known = 1000 * np.outer([1.0, -1.0], [1.0, -1.0]) + 1e-9 * np.eye(2)
    (view,) = objective.views
    asked = Objective(objective.visits, [InformationMatrix(("y",), view.columns, known, 1)])
    assert set(X[choose(asked, 6, None, 0.0, 0).visits]) == {1.0}
