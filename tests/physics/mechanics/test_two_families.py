"""Two families of fibers in a thick wall: closed form, quadrature, textbook, and what symmetry demands."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from braids import random_tubes, textbook_rows, tubes
from hypothesis import given, settings
from hypothesis import strategies as st

from freelearn.data.beds import DEG
from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.closed_form import FiberWall
from freelearn.physics.mechanics.energy import EnergySum, NeoHookean, StandardFiber
from freelearn.physics.mechanics.equilibrium import inflate
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.reference.total_energy import ideal_loads

C1, C2 = 6e5, 1e7
MIRROR = torch.tensor([1.0, -1.0], dtype=torch.float64)

angle = st.floats(12, 78).flatmap(lambda a: st.sampled_from([a, -a]))
elongation, twist, pressure = st.floats(-5, 5), st.floats(-100, 100), st.floats(0, 70)


def loads_at(states, c1=C1, c2=C2):
    with torch.no_grad():
        loads, status = Continuum(c1, c2)(states)
    assert (status == Status.OK).all()
    return loads


def energy():
    return EnergySum([NeoHookean(torch.tensor(C1).double()), StandardFiber(torch.tensor(C2).double())])


def test_the_closed_form_is_the_quadrature():
    """Also of tubes some of which have one family alone. Twenty points integrate these shapes to rounding."""
    tube = Tube.from_states(random_tubes(100, 1, blank=0.3))
    u = tube.unloaded_u * torch.linspace(0.8, 2.0, 100, dtype=torch.float64)
    exact, summed = energy().wall(tube), energy().wall(Tube.from_states(random_tubes(100, 1, blank=0.3), points=20))
    for by_hand, automatic in ((exact.carried(u), summed.carried(u)), (exact.resultants(u), summed.resultants(u))):
        for one, other in zip(by_hand, automatic, strict=True):
            torch.testing.assert_close(one, other, rtol=1e-9, atol=1e-11 * float(other.abs().max()))


def test_both_are_the_textbooks():
    """Loads with the Lagrange multiplier, the radius by root finding; quadratures of 1e-10 of the largest load."""
    states = random_tubes(24, 2, blank=0.2)
    expected = textbook_rows(states, C1=C1, C2=C2)
    assert np.isfinite(expected).all()
    for points in (None, 20):
        u = inflate(states, energy(), points).u
        np.testing.assert_allclose(u.sqrt().numpy(), expected[:, 2], rtol=1e-8)
    loads = loads_at(states).numpy()
    assert (np.abs(loads - expected[:, :2]) / np.abs(expected[:, :2]).max(0)).max() < 1e-8


@settings(max_examples=30, deadline=None)
@given(angle, angle, elongation, twist, pressure)
def test_reciprocity(gamma, second, long, turn, kpa):
    states = tubes(gamma, second, long, turn, kpa)
    model = Continuum(C1, C2)

    def loads(q):
        return model(states.replace(length=q[:1], twist=q[1:])).loads[0]

    jacobian = torch.func.jacrev(loads)(torch.cat([states.length, states.twist])).detach()
    # N/rad; the rounding is that of the largest derivative, ∂F/∂l.
    rounding = 1e-10 * float(jacobian.abs().max())
    assert float(jacobian[0, 1]) == pytest.approx(float(jacobian[1, 0]), rel=1e-6, abs=rounding)


@settings(max_examples=30, deadline=None)
@given(st.floats(12, 78), elongation, twist, pressure)
def test_a_braid_pushes_the_same_whichever_way_it_is_twisted_and_turns_back(gamma, long, turn, kpa):
    there, back, middle = loads_at(tubes(gamma, -gamma, long, [turn, -turn, 0.0], kpa))
    # 1e-9 N and N·m beside tens of N and tenths of N·m.
    torch.testing.assert_close(back, there * MIRROR, rtol=1e-9, atol=1e-9)
    assert float(middle[1]) == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(angle, angle, elongation, twist, pressure)
def test_the_order_of_the_families_is_nothing(gamma, second, long, turn, kpa):
    one, other = loads_at(tubes([gamma, second], [second, gamma], long, turn, kpa))
    torch.testing.assert_close(one, other, rtol=1e-10, atol=1e-10)


@settings(max_examples=30, deadline=None)
@given(angle, angle, elongation, twist, pressure)
def test_the_mirror_image_of_both_families_has_the_mirror_images_loads(gamma, second, long, turn, kpa):
    here, there = loads_at(tubes([gamma, -gamma], [second, -second], long, [turn, -turn], kpa))
    torch.testing.assert_close(there, here * MIRROR, rtol=1e-10, atol=1e-10)


@settings(max_examples=30, deadline=None)
@given(angle, elongation, twist, pressure)
def test_twice_the_same_family_is_one_twice_as_stiff(gamma, long, turn, kpa):
    twice = loads_at(tubes(gamma, gamma, long, turn, kpa))
    torch.testing.assert_close(twice, loads_at(tubes(gamma, np.nan, long, turn, kpa), C1, 2 * C2), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("effects", [[], ["fiber_stiffening"], ["fiber_tension_only", "second_invariant"]])
def test_a_blank_second_family_is_one_family_to_the_last_bit(effects):
    states = random_tubes(40, 5, blank=0.5)
    alone = states.second_share == 0
    assert 5 < int(alone.sum()) < 35
    values = {"fiber_stiffening.k2": 30.0, "fiber_tension_only.share": 0.3, "second_invariant.C01": 1e5}
    model = build_model(
        "continuum", {"C1": C1, "C2": C2} | {n: v for n, v in values.items() if n.split(".")[0] in effects}, effects
    )
    single = replace(states, second_angle=None, second_share=None)
    with torch.no_grad():
        assert torch.equal(model(states).loads[alone], model(single).loads[alone])
        assert not torch.isclose(model(states).loads[~alone], model(single).loads[~alone]).any()


def test_the_walls_modulus_scales_both_families():
    wall = FiberWall.from_tube(Tube.from_states(random_tubes(20, 6, blank=0.4)))
    u = wall.rest * 1.3
    for one, other in zip(wall.scaled(torch.tensor(3.0)).resultants(u), wall.resultants(u), strict=True):
        torch.testing.assert_close(one, 3 * other, rtol=1e-12, atol=0)


EFFECTS = {
    "fiber_stiffening": {"k2": 30.0},
    "fiber_tension_only": {"share": 0.4},
    "fiber_dispersion": {"kappa": 0.02},
    "second_invariant": {"C01": 1e5},
    "fiber_misalignment": {"angle": 0.03},
    "wall_thickness": {"outer_radius": 1e-4},
    "end_clamps": {"clamp_length": 2e-3},
}


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_count_for_each_family_as_in_the_reference(name):
    """The reference adds each family's energy to a potential that it differentiates by complex steps. A tension-only
    fiber has a kink where it is at rest, which the package's six points resolve to 1e-3."""
    states = random_tubes(30, 7, blank=0.3)
    second = np.where(states.second_share > 0, states.second_angle, np.nan)
    s = {"gamma": states.fiber_angle.numpy(), "gamma2": second, "reference": states.reference_length.numpy()}
    s |= {n: getattr(states, f"{n}_radius").numpy() for n in ("inner", "outer")}
    s |= {n: getattr(states, n).numpy() for n in ("length", "twist", "pressure")}
    expected, balanced = ideal_loads(s, C1, C2, {name: EFFECTS[name]})
    model = build_model(
        "continuum", {"C1": C1, "C2": C2} | {f"{name}.{p}": v for p, v in EFFECTS[name].items()}, [name]
    )
    with torch.no_grad():
        loads, status = model(states)
    np.testing.assert_array_equal(status.numpy() == Status.OK, balanced)
    assert balanced.sum() > 25
    tolerance = 1e-3 if name == "fiber_tension_only" else 1e-6
    error = np.abs(loads.numpy() - expected)[balanced] / np.abs(expected[balanced]).max(0)
    assert error.max() < tolerance


def test_a_braid_that_is_misaligned_is_a_braid_of_another_angle():
    drawn, built = tubes(30, -30, 2.0, [-40, 0, 40], 50), tubes(33, -33, 2.0, [-40, 0, 40], 50)
    values = {"C1": C1, "C2": C2}
    model = build_model("continuum", values | {"fiber_misalignment.angle": 3 * DEG}, ["fiber_misalignment"])
    with torch.no_grad():
        torch.testing.assert_close(model(drawn).loads, loads_at(built), rtol=1e-12, atol=1e-12)


def test_derivatives_by_the_moduli_are_those_of_differences():
    """The closed form that a fit uses, with the second family in it."""
    states, model = random_tubes(60, 8, blank=0.3), Continuum(C1, C2)
    vector = model.vector().detach()
    by_hand = model.bind(states).jacobian(vector)
    for i in range(2):
        step = torch.eye(2, dtype=torch.float64)[i] * 1e-5
        with torch.no_grad():
            up, down = (model(states, model.physical(vector + s * step)).loads for s in (1, -1))
        slope = (up - down) / 2e-5
        assert ((by_hand[..., i] - slope).abs() / slope.abs().amax(0)).max() < 1e-7
