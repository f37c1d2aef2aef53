"""Levenberg-Marquardt against certified values, SciPy, and the properties it promises."""

from __future__ import annotations

import warnings
from itertools import pairwise

import nist
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import usually
from scipy.optimize import OptimizeResult, least_squares
from torch import Tensor

from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.solver import Result, State, Termination

T = torch.linspace(0.0, 3.0, 40, dtype=torch.float64)


def tensor(*values: float) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


def status(result: Result | State, member: int = 0) -> Termination:
    return Termination(int(result.status.reshape(-1)[member]))


def complex_step(function, b: Tensor, h: float = 1e-30) -> Tensor:
    """Jacobian by complex steps: exact to rounding, and owing nothing to the differentiation under test."""
    steps = b + 1j * h * torch.eye(len(b), dtype=torch.float64)
    return torch.stack([function(row).imag / h for row in steps], dim=-1)


def scipy_fit(function, start: Tensor, **options) -> OptimizeResult:
    tight = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15, "x_scale": "jac", "max_nfev": 3000}
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return least_squares(
            lambda b: function(torch.as_tensor(b)).numpy(),
            start.numpy(),
            jac=lambda b: complex_step(function, torch.as_tensor(b)).numpy(),
            **(tight | options),
        )


def correct_digits(x: Tensor, certified: Tensor) -> float:
    error = (x - certified).abs() / certified.abs()
    return float(-error.clamp(min=1e-16).log10().max())


# Of thousands of steps.
LONG = ["Bennett5", "MGH09"]


@pytest.mark.parametrize("start", usually(0, nightly=[1]))
@pytest.mark.parametrize("name", usually(*(name for name in nist.MODELS if name not in LONG), nightly=LONG))
def test_nist_digits_at_least_those_of_scipy(name: str, start: int) -> None:
    problem = nist.read(name)
    ours = LevenbergMarquardt(problem.residual).solve(problem.starts[start])
    digits = correct_digits(ours.x, problem.certified)
    # SciPy's lm leaves BoxBOD's first start for a flat region; trf then speaks for SciPy.
    theirs = scipy_fit(problem.residual, problem.starts[start], method="lm")
    if correct_digits(torch.as_tensor(theirs.x), problem.certified) < 6:
        theirs = scipy_fit(problem.residual, problem.starts[start], method="trf")
    assert correct_digits(torch.as_tensor(theirs.x), problem.certified) >= 6
    assert status(ours).converged
    assert digits >= 6
    # Lanczos1's sum of squares, 1e-25, is made of the last bits of its data.
    slack = 1e-2 if name == "Lanczos1" else 1e-9
    assert float(ours.loss) <= 2 * theirs.cost * (1 + slack)
    assert float(ours.loss) == pytest.approx(problem.rss, rel=max(slack, 1e-10))


@given(
    truth=st.tuples(st.floats(-3, 3), st.floats(-2, 2), st.floats(-3, 3)),
    start=st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5)),
    noise=st.floats(0, 1),
    seed=st.integers(0, 2**31),
)
@settings(max_examples=20, deadline=None)
def test_loss_never_rises_and_ends_stationary(truth, start, noise, seed) -> None:
    def model(b: Tensor) -> Tensor:
        return b[0] * torch.exp(-b[1] * T) + torch.sin(b[2] * T)

    random = torch.randn(T.shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    data = model(tensor(*truth)) + noise * random

    def jacobian(b: Tensor) -> Tensor:
        decay = torch.exp(-b[1] * T)
        return torch.stack((decay, -b[0] * T * decay, T * torch.cos(b[2] * T)), dim=-1)

    solver = LevenbergMarquardt(lambda b: model(b) - data, jacobian, max_iterations=200)
    state = solver.init(tensor(*start))
    losses = [float((model(tensor(*start)) - data).square().sum())]
    while state.running:
        state = solver.step(state)
        losses.append(float((model(state.x[0]) - data).square().sum()))
    assert float(state.loss) == pytest.approx(losses[-1], rel=1e-13)
    assert all(later <= earlier for earlier, later in pairwise(losses))
    if status(state).converged and losses[-1] > 1e-20:
        columns, residual = torch.func.jacfwd(model)(state.x[0]), model(state.x[0]) - data
        slope = (columns.mT @ residual).abs()
        orthogonal = slope <= 1e-5 * columns.norm(dim=0) * residual.norm()
        # A rate on its way to infinity leaves a column that is nothing beside the loss.
        flat = slope * state.x[0].abs() <= 1e-9 * losses[-1]
        assert bool((orthogonal | flat).all())


def test_zero_column_is_harmless() -> None:
    data = 2.0 * torch.exp(-0.7 * T) + 0.1 * torch.cos(9 * T)
    short = LevenbergMarquardt(lambda b: b[0] * torch.exp(-b[1] * T) - data).solve(tensor(1.0, 0.1))
    long = LevenbergMarquardt(lambda b: b[0] * torch.exp(-b[2] * T) + 0.0 * b[1] - data)
    result = long.solve(tensor(1.0, 0.3, 0.1))
    assert status(result).converged
    assert float(result.x[1]) == 0.3
    torch.testing.assert_close(result.x[[0, 2]], short.x, rtol=1e-9, atol=0)


def test_dependent_columns_take_the_shortest_step() -> None:
    data = 1.0 + 2.0 * T
    result = LevenbergMarquardt(lambda b: (b[0] + b[1]) + b[2] * T - data).solve(tensor(0.0, 0.0, 0.0))
    assert status(result).converged
    torch.testing.assert_close(result.x, tensor(0.5, 0.5, 2.0), rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("lower", "upper", "on_bound"),
    [
        ((-9.0, 0.0, -9.0), (9.0, 9.0, 9.0), (False, False, False)),
        ((-9.0, 1.2, -9.0), (9.0, 9.0, 9.0), (False, True, False)),
        ((0.0, 0.0, 0.4), (1.5, 9.0, 9.0), (True, False, False)),
        ((-9.0, 0.0, -9.0), (1.0, 0.3, 0.1), (True, False, True)),
    ],
)
def test_bounds_agree_with_scipy(lower, upper, on_bound) -> None:
    data = 2.0 * torch.exp(-0.8 * T) + 0.2 + 0.05 * torch.cos(7 * T)

    def residual(b: Tensor) -> Tensor:
        return b[0] * torch.exp(-b[1] * T) + b[2] - data

    low, high = tensor(*lower), tensor(*upper)
    start = 0.5 * (torch.maximum(low, tensor(0.0, 0.0, 0.0)) + torch.minimum(high, tensor(2.0, 2.0, 2.0)))
    solver = LevenbergMarquardt(residual, lower=low, upper=high)
    state = solver.init(start)
    while state.running:
        state = solver.step(state)
        assert bool(((low <= state.x) & (state.x <= high)).all())
    result = state.result().member(0)
    theirs = scipy_fit(residual, start, method="trf", bounds=(low.numpy(), high.numpy()))
    assert status(result).converged
    assert float(result.loss) <= 2 * theirs.cost * (1 + 1e-10)
    # SciPy's interior iterates stop short of a bound by about the square root of rounding.
    np.testing.assert_allclose(result.x.numpy(), theirs.x, rtol=0, atol=1e-6)
    assert ((result.x == low) | (result.x == high)).tolist() == list(on_bound)
    assert np.logical_or(theirs.x - lower < 1e-6, upper - theirs.x < 1e-6).tolist() == list(on_bound)


def test_rosenbrock_on_its_bound() -> None:
    def residual(b: Tensor) -> Tensor:
        return torch.stack((10 * (b[1] - b[0] ** 2), 1 - b[0]))

    result = LevenbergMarquardt(residual, upper=tensor(0.8, 10.0)).solve(tensor(-1.2, 1.0))
    assert status(result).converged
    assert float(result.x[0]) == 0.8
    assert float(result.x[1]) == pytest.approx(0.64, rel=1e-12)


def test_one_sided_bound_and_start_outside() -> None:
    result = LevenbergMarquardt(lambda b: b - tensor(1.0, -3.0), lower=tensor(0.0, 0.0)).solve(tensor(5.0, -7.0))
    assert result.x.tolist() == [1.0, 0.0]


def test_members_together_equal_each_alone() -> None:
    data = 2.0 * torch.exp(-0.7 * T) + 0.1 * torch.cos(9 * T)
    solver = LevenbergMarquardt(
        lambda b: b[0] * torch.exp(-b[1] * T) + b[2] * b[1] - data, lower=tensor(0.0, 0.1, -1.0)
    )
    starts = tensor(1.0, 0.3, 0.0, 5.0, 2.0, 0.5, 0.1, 1.5, -0.7, 30.0, 0.2, 9.0).reshape(4, 3)
    together = solver.solve(starts)
    assert together.x.shape == (4, 3)
    assert together.loss.shape == (4,)
    for member, start in enumerate(starts):
        alone = solver.solve(start)
        assert alone.x.shape == (3,)
        assert alone.loss.shape == ()
        torch.testing.assert_close(together.x[member], alone.x, rtol=1e-8, atol=1e-10)
        torch.testing.assert_close(together.loss[member], alone.loss, rtol=1e-12, atol=0)
        assert status(together, member).converged


def test_finished_members_stay_frozen() -> None:
    data = 2.0 * torch.exp(-0.7 * T) + 0.1 * torch.cos(9 * T)
    solver = LevenbergMarquardt(lambda b: b[0] * torch.exp(-b[1] * T) - data)
    state = solver.init(torch.stack((solver.solve(tensor(1.0, 1.0)).x, tensor(20.0, 3.0))))
    frozen: dict[int, tuple] = {}
    while state.running:
        state = solver.step(state)
        for member in range(2):
            now = (state.x[member].tolist(), float(state.loss[member]), int(state.iterations[member]))
            if status(state, member) != Termination.RUNNING:
                assert frozen.setdefault(member, now) == now
    assert int(state.iterations[0]) < int(state.iterations[1])
    assert solver.step(state) is state


def test_region_without_finite_residuals_is_survived() -> None:
    data = torch.log(0.05 + T) + 0.02 * torch.sin(8 * T)
    result = LevenbergMarquardt(lambda b: b[1] * torch.log(b[0] + T) - data).solve(tensor(3.0, 4.0))
    theirs = scipy_fit(lambda b: b[1] * torch.log(b[0] + T) - data, tensor(0.06, 1.0), method="lm")
    assert status(result).converged
    np.testing.assert_allclose(result.x.numpy(), theirs.x, rtol=1e-7)


def test_step_onto_a_point_without_finite_jacobian_is_refused() -> None:
    # At b = 0 the loss is lowest, finite, and the slope of the square root is not.
    result = LevenbergMarquardt(lambda b: torch.sqrt(b) + 1.0, lower=tensor(0.0)).solve(tensor(1.0))
    assert 0.0 < float(result.x) < 1e-6
    assert bool(result.jacobian.isfinite().all())


def test_invalid_start_is_a_status_and_spares_the_other_members() -> None:
    solver = LevenbergMarquardt(lambda b: torch.log(b[0] + T) - torch.log(1.0 + T))
    result = solver.solve(tensor(-1.0, 2.0).reshape(2, 1))
    assert status(result, 0) == Termination.INVALID_START
    assert float(result.loss[0]) == float("inf")
    assert float(result.x[0]) == -1.0
    assert "at the start" in result.message(0)
    assert status(result, 1).converged
    assert float(result.x[1]) == pytest.approx(1.0, rel=1e-12)


def test_linear_problem_equals_lstsq() -> None:
    generator = torch.Generator().manual_seed(5)
    matrix = torch.randn(60, 6, generator=generator, dtype=torch.float64)
    data = torch.randn(60, generator=generator, dtype=torch.float64)
    solver = LevenbergMarquardt(lambda b: matrix @ b - data, lambda b: matrix)
    result = solver.solve(torch.ones(6, dtype=torch.float64))
    torch.testing.assert_close(result.x, torch.linalg.lstsq(matrix, data).solution, rtol=1e-10, atol=1e-12)
    assert int(result.iterations) <= 4


def test_fewer_residuals_than_parameters() -> None:
    result = LevenbergMarquardt(lambda b: (b[:2] * b[1:]) - tensor(2.0, 6.0)).solve(tensor(1.0, 1.0, 1.0))
    assert float(result.loss) < 1e-24


def test_wrong_jacobian_is_no_progress_and_few_iterations_are_named() -> None:
    data = torch.exp(-T)
    uphill = LevenbergMarquardt(lambda b: b * torch.ones_like(T) - data, lambda b: -torch.ones(40, 1).double())
    assert status(uphill.solve(tensor(3.0))) == Termination.NO_PROGRESS
    short = LevenbergMarquardt(lambda b: torch.exp(-b * T) - data - 0.1 * T, max_iterations=2)
    result = short.solve(tensor(9.0))
    assert status(result) == Termination.MAX_ITERATIONS
    assert int(result.iterations) == 2
    assert "iteration limit" in result.message()


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="float64"):
        LevenbergMarquardt(lambda b: b).solve(torch.ones(2))
    with pytest.raises(ValueError, match="lower ≤ upper"):
        LevenbergMarquardt(lambda b: b, lower=tensor(1.0), upper=tensor(0.0))
    with pytest.raises(ValueError, match="do not fit 2 parameters"):
        LevenbergMarquardt(lambda b: b, lower=tensor(1.0)).solve(tensor(1.0, 1.0))
    with pytest.raises(ValueError, match="vector"):
        LevenbergMarquardt(lambda b: b.sum()).solve(tensor(1.0, 1.0))
