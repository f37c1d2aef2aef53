"""Intervals cover the truth as often as they say: few kinematic states, errors shared within a state."""

import numpy as np
import pytest
import torch
from nightly import chosen
from scipy.stats import norm, t

from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import Uncertainty, interval, quantile, uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model
from freelearn.testing.small_tables import random_table

STATES, ROWS = 6, 8
ITERATIONS = 5


def few_states(seed: int, count: int = STATES) -> tuple[States, np.ndarray]:
    """Kinematic states of one actuator, a row for each of eight pressures, and the number of each row's state."""
    table = random_table(count, seed).assign(
        sample=3, gamma_deg=40.0, length_mm=100.0, inner_radius_mm=5.0, outer_radius_mm=6.5
    )
    table = table.loc[np.repeat(np.arange(count), ROWS)].reset_index(drop=True)
    table["step"] = np.tile(np.arange(ROWS), count)
    table["pressure_kpa"] = np.tile(np.linspace(5, 72, ROWS), count)
    return States.from_table(table), kinematic_state(table)


def fitted(name: str, seed: int) -> tuple[Uncertainty, np.ndarray]:
    """A fit to loads whose errors are mostly shared by the rows of a state, and the true parameters."""
    truth, model = build_model(name, {}, []), build_model(name, {}, [])
    states, grouping = few_states(seed)
    with torch.no_grad():
        loads = truth(states).loads
    generator = torch.Generator().manual_seed(seed)
    shared = torch.randn(STATES, 2, generator=generator, dtype=torch.float64).repeat_interleave(ROWS, 0)
    own = torch.randn(loads.shape, generator=generator, dtype=torch.float64)
    loads = loads + 0.03 * loads.abs().amax(0) * (shared + 0.3 * own)
    problem = Problem(model, Rows.whole(states, loads, grouping))
    vector = model.vector().detach().clone()
    for _ in range(ITERATIONS if name == "continuum" else 1):
        jacobian = problem.jacobians(vector[None])[0]
        with torch.no_grad():
            residual = problem.residual(vector)
        vector = vector - torch.linalg.lstsq(jacobian, residual[:, None]).solution[:, 0]
    model.set_vector(vector)
    return uncertainty(problem), np.array(list(truth.scalars().values()))


@pytest.mark.parametrize(
    ("name", "count"), [("linear", 300), pytest.param("continuum", 150, marks=[pytest.mark.slow, pytest.mark.nightly])]
)
def test_intervals_of_few_states_cover_and_the_normal_quantile_would_not(name, count):
    covered, normal = [], []
    for seed in chosen(range(count), 100):
        result, truth = fitted(name, seed)
        assert result.freedom == STATES - len(truth)
        covered.append((result.low < truth) & (truth < result.high))
        normal.append(np.abs(result.values - truth) < norm.ppf(0.975) * result.stderr)
    assert 0.90 <= np.mean(covered) <= 0.98
    assert np.mean(normal) < np.mean(covered) - 0.03


def test_intervals_are_those_of_student_and_on_the_logarithm_of_what_is_fitted_so():
    low, high = interval([5.0, 5.0], [1.0, 4.0], [False, True], 3)
    reach = t.ppf(0.975, 3)
    assert (low[0], high[0]) == pytest.approx((5 - reach, 5 + reach))
    assert np.log([low[1], high[1]]) == pytest.approx(np.log(5) + reach * 0.8 * np.array([-1, 1]))
    assert low[1] > 0
    assert quantile(10**6) == pytest.approx(norm.ppf(0.975), rel=1e-5)
    # A parameter that has gone to zero has no logarithm, one that is not determined no interval.
    low, high = interval([0.0, 1.0], [1.0, np.nan], [True, True], 3)
    assert (low[0], high[0]) == pytest.approx((-reach, reach))
    assert np.isnan([low[1], high[1]]).all()
    # However far: without a word of a number that is too large (a warning is an error here).
    low, high = interval([0.0, 1e-9], [1e4, 1e4], [True, True], 3)
    assert (low[0], high[0]) == pytest.approx((-1e4 * reach, 1e4 * reach))
    assert (low[1], high[1]) == (0.0, np.inf)


def test_moduli_of_the_continuum_model_have_positive_skewed_intervals():
    result, _ = fitted("continuum", 1)
    assert (result.low > 0).all()
    assert result.low * result.high == pytest.approx(result.values**2)


def test_fewer_states_than_parameters_leave_one_degree_of_freedom():
    model: Model = build_model("linear", {}, [])
    states, grouping = few_states(0, 2)
    loads = model(states).loads.detach() * 1.01
    assert uncertainty(Problem(model, Rows.whole(states, loads, grouping))).freedom == 1
