"""The tube against the textbook, against physics that must hold, and its derivatives against differences."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from freelearn.data.beds import DEG, KPA, MM
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.energy import Energy, EnergySum, NeoHookean, StandardFiber
from freelearn.physics.mechanics.equilibrium import BALLOON, _halley, _search, inflate, tube_loads
from freelearn.physics.mechanics.layers import QUADRATURE_POINTS
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.simulated_bed import DESIGNS
from freelearn.testing.reference import textbook

C1, C2 = 2e5, 1e6


def tensor(value: float) -> torch.Tensor:
    return torch.tensor(value, dtype=torch.float64)


def one_state(sample: int, elongation: float, twist: float, pressure: float) -> States:
    """One row of a paper's sample: elongation [mm], twist [deg], pressure [kPa]."""
    gamma, length, inner, outer = DESIGNS[sample]

    def t(x: float) -> torch.Tensor:
        return torch.tensor([x], dtype=torch.float64)

    return States(
        fiber_angle=t(gamma * DEG),
        reference_length=t(length * MM),
        inner_radius=t(inner * MM),
        outer_radius=t(outer * MM),
        length=t((length + elongation) * MM),
        twist=t(twist * DEG),
        pressure=t(pressure * KPA),
        sample=torch.tensor([sample + 1]),
        direction=t(0.0),
    )


def textbook_rows(states: States, **material) -> list:
    columns = (
        states.fiber_angle,
        states.reference_length,
        states.inner_radius,
        states.outer_radius,
        states.length,
        states.twist,
        states.pressure,
    )
    return [textbook.continuum_row(*map(float, row), **material) for row in zip(*columns, strict=True)]


def test_agrees_with_the_textbook(random_states):
    states = random_states(60, seed=3)
    expected = textbook_rows(states, C1=C1, C2=C2)
    loads, status = Continuum(C1, C2)(states)
    balanced = np.array([row is not None for row in expected])
    assert balanced.sum() > 40
    np.testing.assert_array_equal(status.numpy() == Status.OK, balanced)
    truth = np.array([row[:2] for row in expected if row is not None])
    error = np.abs(loads.detach().numpy()[balanced] - truth).max(0) / np.abs(truth).max(0)
    assert error.max() < 1e-7


def test_no_equilibrium_is_said_where_the_textbook_finds_none():
    states = one_state(0, 0.0, 110.0, 72.5)
    assert textbook_rows(states, C1=5e4, C2=1e5) == [None]
    loads, status = Continuum(5e4, 1e5)(states)
    assert status.item() == Status.NO_EQUILIBRIUM
    assert loads.isfinite().all()


sample = st.integers(0, 7)
elongation = st.floats(-5, 5)
twist = st.floats(-120, 120)
pressure = st.floats(0, 72.5)
stiff = st.floats(2e5, 2e6), st.floats(2e6, 1e8)


@settings(max_examples=40, deadline=None)
@given(sample, elongation, twist, pressure, *stiff)
def test_reciprocity(sample, elongation, twist, pressure, c1, c2):
    """At fixed pressure wall and fluid are conservative: ∂F/∂φ = ∂M/∂l."""
    states = one_state(sample, elongation, twist, pressure)
    model = Continuum(c1, c2)

    def loads(q: torch.Tensor) -> torch.Tensor:
        return model(states.replace(length=q[:1], twist=q[1:])).loads[0]

    q = torch.cat([states.length, states.twist])
    jacobian = torch.func.jacrev(loads)(q).detach()
    assert math.isclose(jacobian[0, 1], jacobian[1, 0], rel_tol=1e-6, abs_tol=1e-7 * float(jacobian.abs().max()))


@settings(max_examples=25, deadline=None)
@given(sample, elongation, twist, pressure, *stiff)
def test_mirror_image(sample, elongation, twist, pressure, c1, c2):
    """The mirror image of a tube (fiber wound the other way, twisted the other way) has the mirror image's loads."""
    states = one_state(sample, elongation, twist, pressure)
    mirrored = states.replace(fiber_angle=-states.fiber_angle, twist=-states.twist)
    model = Continuum(c1, c2)
    here, there = model(states).loads, model(mirrored).loads
    torch.testing.assert_close(there, here * torch.tensor([1.0, -1.0]), rtol=1e-9, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(sample, *stiff)
def test_no_load_at_the_reference_state(sample, c1, c2):
    loads, status = Continuum(c1, c2)(one_state(sample, 0.0, 0.0, 0.0))
    assert status.item() == Status.OK
    assert loads.abs().max() < 1e-9


def test_loads_scale_with_stiffness_and_pressure(random_states):
    """Doubling every stiffness and the pressure doubles the loads: the equations have no scale of their own."""
    states = random_states(50)
    doubled = states.replace(pressure=2 * states.pressure)
    torch.testing.assert_close(Continuum(2e6, 2e7)(doubled).loads, 2 * Continuum(1e6, 1e7)(states).loads)


def test_batch_equals_loop(random_states):
    states = random_states(30)
    model = Continuum(C1, C2)
    whole = model(states)
    for i in range(len(states)):
        one = model(states[slice(i, i + 1)])
        assert one.status.item() == whole.status[i]
        torch.testing.assert_close(one.loads[0], whole.loads[i], rtol=1e-10, atol=1e-10)


def test_rows_that_balloon_or_are_no_numbers_change_nothing_of_the_others(random_states):
    """A wall that may soften: some rows settle, some meet a falling branch, some have no number at all."""
    states = random_states(40)
    pressure = states.pressure.clone()
    pressure[::4] *= 40.0
    pressure[1::8] = torch.nan
    states = states.replace(pressure=pressure)
    model = build_model("continuum", {"C1": 2e5, "C2": 1e5}, ["limited_extensibility", "fiber_tension_only"])
    model.set_values({"limited_extensibility.beta": 0.05, "fiber_tension_only.share": 0.9})
    with torch.no_grad():
        whole = model(states)
        each = [model(states[slice(i, i + 1)]) for i in range(len(states))]
    assert {Status.OK, Status.NO_EQUILIBRIUM} <= set(whole.status.tolist())
    assert whole.status.tolist() == [one.status.item() for one in each]
    usable = whole.status == Status.OK
    torch.testing.assert_close(
        torch.cat([one.loads for one in each])[usable], whole.loads[usable], rtol=1e-10, atol=1e-10
    )


def test_derivatives_forward_reverse_and_vmap_agree_with_differences(random_states):
    states = random_states(40)
    model = Continuum(C1, C2)
    x = model.vector().detach()
    usable = model(states).status == Status.OK

    def loads(vector: torch.Tensor) -> torch.Tensor:
        return model(states, model.physical(vector)).loads[usable]

    forward = torch.func.jacfwd(loads)(x)
    torch.testing.assert_close(torch.func.jacrev(loads)(x), forward, rtol=1e-9, atol=1e-9)
    step = 1e-5
    for i in range(len(x)):
        shift = torch.zeros_like(x)
        shift[i] = step
        difference = (loads(x + shift) - loads(x - shift)) / (2 * step)
        scale = difference.abs().amax(0)
        assert ((forward[..., i] - difference).abs() / scale).max() < 1e-7
    batch = torch.func.vmap(loads)(torch.stack([x, x + 0.1]))
    torch.testing.assert_close(batch[1], loads(x + 0.1), rtol=1e-10, atol=1e-12)


def test_derivatives_with_respect_to_the_state(random_states):
    states = random_states(40, seed=5)
    model = Continuum(1e6, 2e7)
    for name, step in (("length", 1e-7), ("twist", 1e-5), ("pressure", 1.0)):
        value = getattr(states, name)

        def loads(x: torch.Tensor, name: str = name) -> torch.Tensor:
            return model(states.replace(**{name: x})).loads

        _, derivative = torch.func.jvp(loads, (value,), (torch.ones_like(value),))
        difference = (loads(value + step) - loads(value - step)) / (2 * step)
        assert ((derivative - difference).abs() / difference.abs().amax(0)).max() < 1e-6


@pytest.mark.parametrize(("energy", "count"), [(NeoHookean, 1), (StandardFiber, 1)])
def test_hand_written_energy_derivatives(energy, count):
    term = energy(torch.tensor(3e5, dtype=torch.float64))
    x = torch.linspace(0.8, 4.0, 12, dtype=torch.float64)
    by_hand = term.gradient(x)[0].expand(12)
    torch.testing.assert_close(by_hand, Energy.gradient(term, x)[0])
    (value,), (rate,) = term.gradient_rate((x,), (2 * x,))
    (_,), (expected,) = torch.func.jvp(lambda i: Energy.gradient(term, i), (x,), (2 * x,))
    torch.testing.assert_close(value.expand(12), by_hand)
    torch.testing.assert_close(torch.zeros(12).double() if rate is None else rate, expected)


class MooneyTerm(Energy):
    """Ψ = c (I₂ − 3): written with Ψ only, so every derivative is automatic."""

    depends_on = ("i2",)

    def psi(self, *invariants: torch.Tensor) -> torch.Tensor:
        return 4e4 * (invariants[0] - 3)


def test_second_invariant_energy_agrees_with_the_textbook(random_states):
    states = random_states(15, seed=8)
    energy = EnergySum([NeoHookean(torch.tensor(3e5)), StandardFiber(torch.tensor(5e6)), MooneyTerm()])
    wall, u, balanced, _ = inflate(states, energy)
    assert balanced.all()
    expected = textbook_rows(
        states, psi1=lambda i1, i2, i4: 1.5e5, psi2=lambda i1, i2, i4: 4e4, psi4=lambda i1, i2, i4: 5e6 * (i4 - 1)
    )
    truth = np.array([row[:2] for row in expected])
    error = np.abs(tube_loads(wall, u).numpy() - truth).max(0) / np.abs(truth).max(0)
    assert error.max() < 1e-7
    np.testing.assert_allclose(u.sqrt().numpy(), [row[2] for row in expected], rtol=1e-8)


def test_radius_stays_below_the_ballooning_bound(random_states):
    states = random_states(300)
    _, u, balanced, _ = inflate(states, EnergySum([NeoHookean(torch.tensor(1e5)), StandardFiber(torch.tensor(5e5))]))
    assert 0 < (~balanced).sum() < len(states)
    assert (u.sqrt() <= BALLOON * states.inner_radius * (1 + 1e-12)).all()


@pytest.mark.parametrize("energy", [NeoHookean, StandardFiber])
def test_closed_forms_agree_with_quadrature(energy, random_states):
    """What the wall carries, its slope and its resultants; six points do it to 1e-6 even at half the radius."""
    states = random_states(200)
    term = EnergySum([energy(torch.tensor(3e5, dtype=torch.float64))])
    tube = Tube.from_states(states)
    u = states.inner_radius**2 * torch.linspace(0.5, 4.0, len(states), dtype=torch.float64)
    exact = term.wall(tube)
    for points, tolerance in ((QUADRATURE_POINTS, 1e-6), (20, 1e-12)):
        summed = term.wall(replace(tube, points=points))
        assert type(summed) is not type(exact)
        for by_hand, automatic in ((exact.carried(u), summed.carried(u)), (exact.resultants(u), summed.resultants(u))):
            for one, other in zip(by_hand, automatic, strict=True):
                assert (one - other).abs().max() <= tolerance * other.abs().max()


@pytest.mark.parametrize("energy", [NeoHookean, StandardFiber])
def test_closed_forms_know_their_derivatives(energy, random_states):
    states = random_states(50)
    wall = EnergySum([energy(torch.tensor(3e5, dtype=torch.float64))]).wall(Tube.from_states(states))
    u = states.inner_radius**2 * torch.linspace(0.5, 4.0, 50, dtype=torch.float64)

    def derivative(f, at):
        return torch.func.jvp(f, (at,), (torch.ones_like(at),))[1]

    expansion, slope = wall.expansion(u), derivative(lambda v: wall.carried(v).pressure, u)
    torch.testing.assert_close(expansion.pressure, wall.carried(u).pressure, rtol=1e-14, atol=1e-6)
    torch.testing.assert_close(expansion.rise, u * slope, rtol=1e-11, atol=1e-6)
    bend = u * u * derivative(lambda v: wall.carried(v).slope, u)
    torch.testing.assert_close(expansion.bend.expand_as(u), bend, rtol=1e-10, atol=1e-6)
    for i, rate in enumerate(wall.rates(u)):
        torch.testing.assert_close(rate, derivative(lambda v, i=i: wall.resultants(v)[i], u), rtol=1e-10, atol=1e-6)


@pytest.mark.parametrize("material", [(2e5, 1e6), (1e4, 1e8), (1e8, 1e4), (1e5, 1e8), (3e4, 2e5)])
def test_halley_finds_what_the_bracketed_search_finds(material, random_states):
    """Third-order steps on walls that stiffen: the same equilibria, also where no one can look (inside vmap)."""
    states = random_states(2000)
    energy = EnergySum([NeoHookean(tensor(material[0])), StandardFiber(tensor(material[1]))])
    tube = Tube.from_states(states)
    wall, reference = energy.wall(tube), states.inner_radius**2
    quick, settled = _halley(wall, tube.unloaded_u, BALLOON**2 * reference, states.pressure)
    assert settled.all()
    slow, balanced = _search(wall, tube.unloaded_u, BALLOON**2 * reference, states.pressure)
    assert torch.equal(quick < BALLOON**2 * reference, balanced)
    torch.testing.assert_close(quick, slow, rtol=1e-6, atol=0)
    pressures = torch.stack([states.pressure, 0.5 * states.pressure])
    u, inside = torch.func.vmap(lambda p: inflate(states.replace(pressure=p), energy)[1:3])(pressures)
    assert torch.equal(inside[0], balanced)
    torch.testing.assert_close(u[0], inflate(states, energy).u, rtol=1e-12, atol=0)


@pytest.mark.parametrize("material", [(2e5, 1e6), (3e4, 2e5), (1e6, 4e7)])
def test_the_jacobian_in_closed_form_is_the_automatic_one(material, random_states):
    """Also for rows that balloon."""
    states, model = random_states(300), Continuum(*material)
    vector = model.vector().detach()
    expected = torch.func.jacrev(lambda v: model(states, model.physical(v)).loads)(vector)
    bound = model.bind(states)
    bound.loads(vector - 1.0)
    by_hand = bound.jacobian(vector)
    torch.testing.assert_close(bound.loads(vector), model(states).loads.detach(), rtol=1e-12, atol=1e-12)
    assert ((by_hand - expected).abs() <= 1e-7 * expected.abs().amax((0, 2), keepdim=True)).all()
    if material == (3e4, 2e5):
        assert (model(states).status == Status.NO_EQUILIBRIUM).any()


def test_models_without_closed_form_bind_nothing(random_states):
    states = random_states(5)
    for name in ("continuum_linear_material", "continuum_thin_wall"):
        model = build_model(name)
        assert model.bind(states) is None
    assert build_model("continuum", {}, ["force_gain"]).bind(states) is None
