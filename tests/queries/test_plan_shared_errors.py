"""Rows of one mounting share a position error: what they tell, against least squares with the whole covariance."""

import numpy as np
import pytest
import torch

from freelearn.data.accuracy import PAPER
from freelearn.discovery.noise.noise import Whitener
from freelearn.queries.next_measurements.candidates import Path
from freelearn.queries.next_measurements.views import InformationMatrix, Visits, refitted, remaining, slope, value


def dense(columns: np.ndarray, shared: np.ndarray) -> np.ndarray:
    """Xᵀ Σ⁻¹ X by hand: X (n, 2, k), Σ = I + A Aᵀ of one visit with A (n, 2, 2)."""
    flat, a = columns.reshape(-1, columns.shape[-1]), shared.reshape(-1, 2)
    return flat.T @ np.linalg.inv(np.eye(len(flat)) + a @ a.T) @ flat


def test_a_visit_tells_what_generalized_least_squares_says():
    generator = np.random.default_rng(0)
    shared, columns = generator.normal(size=(5, 4, 2, 2)) * 3, generator.normal(size=(5, 4, 2, 3))
    visits = Visits.from_masks(shared, np.ones((5, 4), dtype=bool))
    for number in generator.choice(visits.allowed.size, 30, replace=False):
        place, rows = visits.rows_of(number)
        expected = dense(columns[place, rows], shared[place, rows])
        assert visits.added(columns, np.array([number]))[0] == pytest.approx(expected, rel=1e-9)
    u = generator.normal(size=(3, 2))
    seen = visits.sensitivities(columns @ u)
    everything = np.arange(visits.allowed.size)
    trace = np.einsum("kq,ckl,lq->c", u, visits.added(columns, everything), u)
    assert seen.reshape(-1) == pytest.approx(trace, rel=1e-9)


def test_it_agrees_with_the_whitener_of_the_search():
    generator = np.random.default_rng(1)
    sensitivity = torch.as_tensor(generator.normal(size=(4, 2, 3)) * [1e3, 5.0, 1e-4])
    columns = torch.as_tensor(generator.normal(size=(4, 2, 3)))
    apart = Whitener(sensitivity, torch.arange(4), PAPER)
    together = Whitener(sensitivity, torch.zeros(4, dtype=torch.int64), PAPER)
    shared = apart.shared.numpy()[None]
    visits = Visits.from_masks(shared, np.ones((1, 4), dtype=bool))
    whole = int(np.flatnonzero(visits.sizes == 4)[0])
    white = together(columns).flatten(0, 1)
    told = visits.added(apart.apart(columns).numpy()[None], np.array([whole]))[0]
    assert told == pytest.approx((white.T @ white).numpy(), rel=1e-9)


def test_many_rows_of_a_mounting_tell_no_more_than_its_position_lets_them():
    # One reading, one coefficient, a shared error as large as ten of the row's own: n rows tell n/(1 + 100 n).
    shared, columns = np.zeros((1, 5, 2, 2)), np.zeros((1, 5, 2, 1))
    shared[..., 0, 0], columns[..., 0, 0] = 10.0, 1.0
    visits = Visits.from_masks(shared, np.ones((1, 5), dtype=bool))
    told = visits.added(columns, np.arange(len(visits.subsets)))[:, 0, 0]
    assert told == pytest.approx(visits.sizes / (1 + 100 * visits.sizes))


def test_a_visit_begins_rises_and_falls():
    path = Path.both(3)
    pressure, direction = path.level, path.direction
    subsets = path.subsets(None)
    # 1 first row at most, which is the lowest of those that rise; what falls is lower than the highest: 1 + 4 + 16.
    assert len(subsets) == 21
    assert len({tuple(rows) for rows in subsets.tolist()}) == 21
    for rows in subsets:
        up, down = pressure[rows & (direction >= 0)], pressure[rows & (direction < 0)]
        assert (direction[rows] == 0).sum() == 1
        assert (np.diff(up) > 0).all()
        assert (np.diff(down) < 0).all()
        assert not len(down) or down.max() < up.max()
    assert Path.both(3).subsets(2).sum(1).max() == 2
    assert len(Path.rising(3).subsets(None)) == 7


@pytest.mark.parametrize("interest", [1, 2])
def test_slopes_are_those_of_the_value(interest):
    generator = np.random.default_rng(2)
    root = generator.normal(size=(4, 4))
    information, change = root @ root.T + np.eye(4), generator.normal(size=(4, 4))
    change = change + change.T
    u = slope(information, interest)
    step = 1e-6
    both = [float(value(information + s * step * change, interest)) for s in (1, -1)]
    assert np.sum(u * (change @ u)) == pytest.approx((both[0] - both[1]) / (2 * step), rel=1e-6)
    assert np.sum(u * (information @ u)) == pytest.approx(float(value(information, interest)))


def test_what_is_left_is_the_inverse_of_the_covariance_and_units_do_not_matter():
    generator = np.random.default_rng(3)
    root = generator.normal(size=(4, 9))
    information = root @ root.T
    left = remaining(information, 2)
    assert left == pytest.approx(np.linalg.inv(np.linalg.inv(information)[2:, 2:]))
    moved = refitted(information, 2)
    assert moved.T @ information @ moved == pytest.approx(left)
    columns, units = generator.normal(size=(6, 1, 2, 4)), np.array([1e-6, 1e4, 1.0, 1.0])
    plain = InformationMatrix.scaled(("a",), columns, information, 2)
    odd = InformationMatrix.scaled(("a",), columns * units, information * units * units[:, None], 2)
    assert float(value(odd.known, 2)) == pytest.approx(float(value(plain.known, 2)), rel=1e-6)
