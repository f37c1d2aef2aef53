"""The stress of a sheet stretched in two directions is the slope of its energy, whatever the modes are called."""

import numpy as np
import pytest
import torch
from closed_forms import ACROSS, STRESS
from hypothesis import given
from hypothesis import strategies as st

from freelearn.physics.mechanics.energy import Energy, nominal_stress

STRETCH = st.floats(0.5, 3.0)


class Mixed(Energy):
    """Ψ of both invariants at once, so that neither slope is constant."""

    depends_on = ("i1", "i2")

    def psi(self, *invariants: torch.Tensor) -> torch.Tensor:
        first, second = invariants[0] - 3, invariants[1] - 3
        return 1.5e5 * first + 2e4 * second + 3e3 * first * second + 5e2 * second**2


class Linear(Energy):
    """Ψ = 1.5e5 (I₁ − 3) + 2e4 (I₂ − 3)."""

    depends_on = ("i1", "i2")

    def psi(self, *invariants: torch.Tensor) -> torch.Tensor:
        return 1.5e5 * (invariants[0] - 3) + 2e4 * (invariants[1] - 3)


def stress(along: float, across: float, term: type[Energy] = Mixed) -> float:
    one, two = (torch.tensor([x], dtype=torch.float64) for x in (along, across))
    return float(nominal_stress([term()], one, two))


def work(one: float, two: float) -> float:
    """Ψ [Pa] of the deformation gradient diag(λ₁, λ₂, 1/(λ₁λ₂)), by traces of C and its square."""
    F = np.diag([one, two, 1 / (one * two)])
    C = F.T @ F
    first, second = np.trace(C), (np.trace(C) ** 2 - np.trace(C @ C)) / 2
    return float(Mixed().psi(torch.tensor(first), torch.tensor(second)))


@given(STRETCH, STRETCH)
def test_both_stresses_are_slopes_of_the_energy(one, two):
    h = 1e-5
    along = (work(one + h, two) - work(one - h, two)) / (2 * h)
    across = (work(one, two + h) - work(one, two - h)) / (2 * h)
    scale = abs(along) + abs(across) + 1e5
    assert stress(one, two) == pytest.approx(along, abs=1e-6 * scale)
    assert stress(two, one) == pytest.approx(across, abs=1e-6 * scale)


@given(STRETCH, STRETCH)
def test_work_around_a_closed_path_is_zero(one, two):
    # ∂P₁/∂λ₂ = ∂P₂/∂λ₁: stresses that no energy gives break this.
    h = 1e-5
    first = (stress(one, two + h) - stress(one, two - h)) / (2 * h)
    second = (stress(two, one + h) - stress(two, one - h)) / (2 * h)
    assert first == pytest.approx(second, rel=1e-5, abs=1.0)


@given(STRETCH)
def test_the_old_modes_are_special_cases(x):
    for mode, closed in STRESS.items():
        across = float(ACROSS[mode](np.float64(x)))
        assert stress(x, across, Linear) == pytest.approx(closed(x, 1.5e5, 2e4), rel=1e-9, abs=1e-6)


@given(STRETCH, STRETCH)
def test_the_direction_stretched_further_carries_the_larger_true_stress(one, two):
    # Baker & Ericksen (1954): so for every energy that grows with I₁ and I₂.
    difference = one * stress(one, two, Linear) - two * stress(two, one, Linear)
    assert difference * (one - two) >= -1e-6


@given(STRETCH)
def test_a_free_side_carries_nothing(x):
    assert stress(x**-0.5, x) == pytest.approx(0.0, abs=1e-6)
