"""The reference implementations agree with each other, and with what is known of them.

The paper's table and protocol are written out here again: nothing of the package takes part.
"""

import math
import warnings

import numpy as np
import pytest

from freelearn.testing.reference import textbook
from freelearn.testing.reference.numpy_peer import continuum

DEG = math.pi / 180
GAMMA = DEG * np.array([15.0, 25, 36, 40, 50, 62, 73, 76])
LENGTH = 1e-3 * np.array([90.48, 120.52, 98.42, 90.48, 120.40, 99.00, 128.9, 103.22])
INNER = np.full(8, 4.77e-3)
OUTER = 1e-3 * np.array([6.13, 6.62, 6.74, 6.13, 6.41, 6.36, 6.40, 6.18])
C1, C2 = 2e5, 1e6
RISING_KPA = np.linspace(0, 72.5, 8)


def random_rows(count, seed):
    """Arrays (γ, L, R_i, R_o, l, φ, P) in SI at random states of random samples."""
    generator = np.random.default_rng(seed)
    i = generator.integers(0, 8, count)
    length = LENGTH[i] + 1e-3 * generator.uniform(-5, 5, count)
    phi, pressure = generator.uniform(-120, 120, count) * DEG, generator.uniform(0, 72.5e3, count)
    return GAMMA[i], LENGTH[i], INNER[i], OUTER[i], length, phi, pressure


def protocol(sample, falling_kpa):
    """One sample's 11 × 26 × 10 states."""
    tens = np.arange(10.0, 121, 10)
    elongations, twists = 1e-3 * np.arange(-5.0, 6), DEG * np.concatenate([-tens[::-1], [-1, 1], tens])
    pressures = 1e3 * np.concatenate([RISING_KPA, falling_kpa])
    e, phi, p = (x.ravel() for x in np.meshgrid(elongations, twists, pressures, indexing="ij"))
    design = (np.full_like(e, x[sample]) for x in (GAMMA, LENGTH, INNER, OUTER))
    return *design, LENGTH[sample] + e, phi, p


def slow_rows(arrays):
    return [textbook.continuum_row(*map(float, row), C1=C1, C2=C2) for row in zip(*arrays, strict=True)]


def potential(gamma, L, Ri, Ro, length, phi, P, ri):
    """W − P V [J] of the tube and its fluid, W = ∫ Ψ 2πRL dR, V = π r_i² l; takes complex arguments."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    R, stretch, k = Ri + (Ro - Ri) / 2 * (1 + nodes), length / L, phi / L
    r2 = (R**2 - Ri**2) / stretch + ri**2
    i1 = R**2 / (r2 * stretch**2) + r2 / R**2 + r2 * k**2 + stretch**2
    i4 = r2 * (np.sin(gamma) / R + k * np.cos(gamma)) ** 2 + (stretch * np.cos(gamma)) ** 2
    energy = C1 / 2 * (i1 - 3) + C2 / 2 * (i4 - 1) ** 2
    return (weights * (Ro - Ri) / 2 * 2 * np.pi * R * L * energy).sum() - P * np.pi * ri**2 * length


def test_textbook_and_numpy_agree():
    arrays = random_rows(40, 2)
    slow = slow_rows(arrays)
    for ours, column in zip(continuum(*arrays, C1, C2), (0, 1), strict=True):
        expected = np.array([np.nan if row is None else row[column] for row in slow])
        np.testing.assert_array_equal(np.isnan(ours), np.isnan(expected))
        assert np.nanmax(np.abs(ours - expected)) < 1e-9 * np.nanmax(np.abs(expected))


def test_textbook_agrees_with_the_derivatives_of_the_energy():
    """No stress at all: F = −∂(W − PV)/∂l, M = −∂(W − PV)/∂φ, 0 = ∂(W − PV)/∂r_i, by complex steps."""
    arrays = random_rows(40, 3)
    solved = zip(zip(*arrays, strict=True), slow_rows(arrays), strict=True)
    pairs = [(row, answer) for row, answer in solved if answer]
    assert len(pairs) > 30
    errors, loads, residuals = [], [], []
    for (*design, length, phi, P), (force, moment, ri) in pairs:
        h = 1e-30
        energetic = (
            -potential(*design, length + 1j * h, phi, P, ri).imag / h,
            -potential(*design, length, phi + 1j * h, P, ri).imag / h,
        )
        errors.append(np.subtract((force, moment), energetic))
        loads.append(energetic)
        # ∂/∂r_i over the lateral surface is the unbalanced pressure.
        unbalanced = potential(*design, length, phi, P, ri + 1j * h).imag / h
        residuals.append(unbalanced / (2 * np.pi * ri * length))
    assert np.all(np.abs(errors).max(0) < 1e-10 * np.abs(loads).max(0))
    assert np.abs(residuals).max() < 1e-5


def test_unloaded_tubes_exert_nothing():
    zero = np.zeros(8)
    arrays = (GAMMA, LENGTH, INNER, OUTER, LENGTH, zero, zero)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # an integral of zero must not send quad in circles
        slow = np.array(slow_rows(arrays))
    np.testing.assert_allclose(slow[:, :2], 0, atol=1e-10)
    np.testing.assert_allclose(slow[:, 2], INNER, rtol=1e-12)
    np.testing.assert_allclose(continuum(*arrays, C1, C2), 0, atol=1e-8)
    for gamma, length, outer in zip(GAMMA, LENGTH, OUTER, strict=True):
        assert textbook.linear_row(gamma, length, outer, length, 0.0, 0.0, 900.0, 0.05, -1.5) == (0, 0)


@pytest.mark.parametrize("falling_kpa", [RISING_KPA[[4, 2]], RISING_KPA[[3, 0]], [36.25, 0.0]])
def test_477_states_of_sample_one_have_no_radius(falling_kpa):
    """All 477 (83 + 176 + 218) come from the top three rising steps; the notes leave the falling two open.

    No state is lost up to 47.5 kPa, so two falling steps below that cannot change the count.
    """
    force, moment = continuum(*protocol(0, falling_kpa), C1, C2)
    assert force.shape == (2860,)
    np.testing.assert_array_equal(np.isnan(force), np.isnan(moment))
    per_step = np.isnan(force).reshape(-1, 10).sum(0)
    assert per_step.tolist() == [0, 0, 0, 0, 0, 83, 176, 218, 0, 0]


def test_both_refuse_the_same_states():
    arrays = tuple(x[::53] for x in protocol(0, [36.25, 0.0]))
    refused = np.isnan(continuum(*arrays, C1, C2)[0])
    assert 0 < refused.sum() < len(refused)
    assert [row is None for row in slow_rows(arrays)] == refused.tolist()
