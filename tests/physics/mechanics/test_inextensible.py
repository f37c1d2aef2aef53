"""Fibers that cannot stretch, one family or two: McKibben's formula, virtual work, and the limit of stiff fibers."""

import numpy as np
import pytest
import torch
from braids import LENGTH, OUTER, random_tubes, tubes
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from freelearn.data.beds import DEG, KPA, MM
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.inextensible import helix
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.reference.total_energy import wall_energy

SOFT = {"linear": {"ka": 1e-9, "kb": 1e-12, "kc": 0.0}, "continuum_inextensible": {"C1": 1e-9}}


def mckibben(gamma: float, contraction: np.ndarray, pressure: float) -> np.ndarray:
    """Pull [N] of a braid under a pressure [Pa], π r0² P [a (1 − ε)² − b] (Chou & Hannaford 1996; Tondu & Lopez)."""
    a, b = 3 / np.tan(gamma) ** 2, 1 / np.sin(gamma) ** 2
    return np.pi * (OUTER * MM) ** 2 * pressure * (a * (1 - contraction) ** 2 - b)


@pytest.mark.parametrize("name", SOFT)
@pytest.mark.parametrize("gamma", [20.0, 32.0, 54.7356, 68.0])
def test_a_braid_pulls_as_chou_and_hannaford_say(name, gamma):
    contraction = np.linspace(-0.02, 0.15, 9)
    states = tubes(gamma, -gamma, -contraction * LENGTH, 0.0, 60.0)
    with torch.no_grad():
        loads, status = build_model(name, SOFT[name])(states)
    assert (status == Status.OK).all()
    np.testing.assert_allclose(loads[:, 0].numpy(), -mckibben(gamma * DEG, contraction, 60 * KPA), rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(loads[:, 1].numpy(), 0.0, atol=1e-12)


def least_squares_radius2(states: States, i: int, length: float, twist: float) -> float:
    """r² [m²] at which both families together are stretched least, by a minimizer of their own energy."""
    angles = [float(states.fiber_angle[i]), float(states.second_angle[i])][: 1 + int(states.second_share[i])]
    long, wide = float(states.reference_length[i]), float(states.outer_radius[i])

    def energy(share: float) -> float:
        r2 = share * wide**2
        hoop = [r2 * (np.sin(g) / wide + twist / long * np.cos(g)) ** 2 for g in angles]
        along = [(length / long * np.cos(g)) ** 2 for g in angles]
        return sum((h + a - 1) ** 2 for h, a in zip(hoop, along, strict=True))

    found = minimize_scalar(energy, bracket=(0.5, 1.5), method="brent", options={"xtol": 1e-12})
    return float(found.x) * wide**2


def test_the_radius_stretches_both_families_least():
    """Brent's method finds a minimum to the root of rounding, 1e-8."""
    states = random_tubes(40, 1, blank=0.3)
    radius2 = helix(states).radius2.numpy()
    expected = [least_squares_radius2(states, i, float(states.length[i]), float(states.twist[i])) for i in range(40)]
    np.testing.assert_allclose(radius2, expected, rtol=1e-5, atol=1e-12)


def test_the_fluids_thrust_is_the_rate_of_its_volume():
    """∂(r² l)/∂l and ∂(r² l)/∂φ against central differences, whose error is 1e-7 of them."""
    states = random_tubes(60, 2, blank=0.3)
    fibers = helix(states)
    for name, step, rate in (("length", 1e-7, fibers.by_length), ("twist", 1e-6, fibers.by_twist)):
        here = getattr(states, name)
        up, down = (states.replace(**{name: here + s * step}) for s in (1, -1))
        slope = (helix(up).radius2 * up.length - helix(down).radius2 * down.length) / (2 * step)
        torch.testing.assert_close(rate, slope, rtol=1e-6, atol=1e-6 * float(slope.abs().max()))


def test_the_inextensible_tube_works_as_its_potential_says():
    """Π = W(l, φ) − P V(l, φ) of the reference's wall, whose inner radius the fibers fix: loads by differences."""
    states = random_tubes(60, 3, blank=0.3)
    model = build_model("continuum_inextensible", {"C1": 4e5})
    with torch.no_grad():
        loads, status = model(states)
    design = [getattr(states, f).numpy() for f in ("reference_length", "inner_radius", "outer_radius")]
    nothing = np.full(len(states), np.nan)

    def potential(at: States) -> np.ndarray:
        solid = (design[2] ** 2 - design[1] ** 2) * design[0] / at.length.numpy()
        inside = helix(at).radius2.numpy() - solid
        ones = np.ones(len(at))
        wall = wall_energy(
            at.length.numpy() + 0j, at.twist.numpy(), inside + 0j, [nothing], *design, ones, 4e5, 0.0, {}
        )
        return wall.real - at.pressure.numpy() * np.pi * inside * at.length.numpy()

    ok = (status == Status.OK).numpy()
    assert ok.sum() > 25
    for column, (name, step) in enumerate((("length", 1e-6), ("twist", 1e-5))):
        here = getattr(states, name)
        up, down = (potential(states.replace(**{name: here + s * step})) for s in (1, -1))
        expected = -(up - down)[ok] / (2 * step)
        error = np.abs(loads[ok, column].numpy() - expected)
        # Near a closed bore the wall's energy grows without bound: relative to each row's own load.
        assert (error < 1e-5 * np.abs(expected) + 1e-6 * np.median(np.abs(expected))).all()


@settings(max_examples=25, deadline=None)
@given(st.floats(20, 70), st.floats(-0.05, 0.05), st.floats(-60, 60))
def test_a_braid_is_even_in_twist(gamma, contraction, turn):
    fibers = helix(tubes(gamma, -gamma, -contraction * LENGTH, [turn, -turn], 50.0))
    assert float(fibers.radius2[0]) == pytest.approx(float(fibers.radius2[1]), rel=1e-9)
    assert float(fibers.by_length[0]) == pytest.approx(float(fibers.by_length[1]), rel=1e-9, abs=1e-12)
    assert float(fibers.by_twist[0]) == pytest.approx(-float(fibers.by_twist[1]), rel=1e-9, abs=1e-12)


def test_a_blank_family_is_none_to_rounding_and_the_order_is_nothing():
    states = random_tubes(30, 4, blank=1.0)
    assert states.second_angle is None
    with_blank = random_tubes(30, 5, blank=0.5)
    single = States(**{f: getattr(with_blank, f) for f in with_blank.__dataclass_fields__} | {"second_angle": None})
    alone = with_blank.second_share == 0
    for one, other in zip(helix(with_blank), helix(single), strict=True):
        torch.testing.assert_close(one[alone], other[alone], rtol=1e-12, atol=0)
    swapped = with_blank.replace(fiber_angle=with_blank.second_angle, second_angle=with_blank.fiber_angle)
    for one, other in zip(helix(with_blank)[:3], helix(swapped)[:3], strict=True):
        torch.testing.assert_close(one[~alone], other[~alone], rtol=1e-10, atol=0)


def test_stiff_fibers_tend_to_inextensible_ones():
    """Thin walls, where the fibers lie at one radius. Twisted, a braid's families are at odds, but the radius is the
    one that both like best; untwisted, the loads agree too. The wall is 0.2 % of the radius, and its fibers of 1 GPa
    stretch by 0.2 %; stiffer ones would bear on what I₄ varies through the wall."""
    thin = {"inner_radius": torch.full((12,), OUTER * MM / 1.002, dtype=torch.float64)}
    twisted = tubes(35.0, -35.0, -3.0, np.linspace(-80, 80, 12), 2.0).replace(**thin)
    straight = tubes(35.0, -35.0, np.linspace(-12, 0.5, 12), 0.0, 2.0).replace(**thin)
    one = tubes(35.0, np.nan, np.linspace(-12, 0.5, 12), np.linspace(-40, 40, 12), 2.0).replace(**thin)
    stiff, rigid = Continuum(1e3, 1e9), build_model("continuum_inextensible", {"C1": 1e3})
    with torch.no_grad():
        for states in (twisted, straight, one):
            wide, fixed = (m.diameter(states, m.values()) for m in (stiff, rigid))
            torch.testing.assert_close(wide, fixed, rtol=4e-3, atol=0)
        for states in (straight, one):
            here, there = stiff(states), rigid(states)
            assert (here.status == Status.OK).all()
            assert (there.status == Status.OK).all()
            scale = there.loads.abs().amax(0).clamp_min(1e-3)
            assert float(((here.loads - there.loads) / scale).abs().max()) < 0.01


@pytest.mark.parametrize("name", ["linear", "continuum_inextensible"])
def test_rows_that_fibers_forbid_are_marked_and_finite(name):
    """Longer than the fibers; unwound to the axis (both of a braid cannot be, so that it is never singular)."""
    unwound = -np.rad2deg(LENGTH / OUTER * np.tan(20 * DEG))
    gamma = [20.0, 20.0, 20.0, 20.0, 20.0]
    second = [-20.0, -20.0, 20.0, np.nan, -20.0]
    long = [LENGTH * (1 / np.cos(20 * DEG) - 1) + 1.0, -2.0, -2.0, -2.0, -2.0]
    states = tubes(gamma, second, long, [0.0, unwound, unwound, unwound, 0.0], 30.0)
    loads, status = build_model(name)(states)
    assert loads.isfinite().all()
    assert status[0] == Status.OVERSTRETCHED
    assert status[2:].tolist() == [Status.SINGULAR, Status.SINGULAR, Status.OK]
    assert status[1] != Status.SINGULAR
    model = build_model(name)
    vector = model.vector().detach().requires_grad_()
    model(states, model.physical(vector)).loads.sum().backward()
    assert vector.grad.isfinite().all()
