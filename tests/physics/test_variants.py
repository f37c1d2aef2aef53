"""Variants of the continuum model, against what they must become at their limits."""

import math

import pytest
import torch

from freelearn.physics.chain.prediction import Status
from freelearn.physics.mechanics.energy import LinearMaterial
from freelearn.physics.models.build import build_model

VALUES = {"C1": 1e6, "C2": 3e7}


def derivatives(model, states):
    """∂F/∂φ and ∂M/∂l of every row."""
    length, twist = (getattr(states, n).clone().requires_grad_() for n in ("length", "twist"))
    loads = model(states.replace(length=length, twist=twist)).loads
    (force_by_twist,) = torch.autograd.grad(loads[:, 0].sum(), twist, retain_graph=True)
    (moment_by_length,) = torch.autograd.grad(loads[:, 1].sum(), length)
    return force_by_twist, moment_by_length


@pytest.mark.parametrize("name", ["continuum_linear_material", "continuum_thin_wall", "continuum_inextensible"])
def test_conservative_and_at_rest_without_load(name, random_states):
    model = build_model(name, {k: v for k, v in VALUES.items() if k == "C1" or name != "continuum_inextensible"})
    states = random_states(60)
    ok = model(states).status == Status.OK
    assert ok.sum() > 20
    force_by_twist, moment_by_length = derivatives(model, states[ok])
    torch.testing.assert_close(
        force_by_twist, moment_by_length, rtol=1e-7, atol=1e-9 * float(force_by_twist.abs().max())
    )
    rest = states.replace(
        length=states.reference_length, twist=torch.zeros_like(states.twist), pressure=torch.zeros_like(states.pressure)
    )
    torch.testing.assert_close(model(rest).loads, torch.zeros(60, 2, dtype=torch.float64), rtol=0, atol=1e-9)


def test_the_linear_material_is_hookes_law_in_the_green_lagrange_strain():
    generator = torch.Generator().manual_seed(0)
    gradient = torch.eye(3, dtype=torch.float64) + 0.3 * torch.randn(50, 3, 3, dtype=torch.float64, generator=generator)
    right = gradient.mT @ gradient
    right = right / torch.linalg.det(right)[:, None, None] ** (1 / 3)
    strain = (right - torch.eye(3, dtype=torch.float64)) / 2
    i1 = right.diagonal(dim1=1, dim2=2).sum(1)
    i2 = (i1**2 - (right @ right).diagonal(dim1=1, dim2=2).sum(1)) / 2
    expected = 7e5 * (strain * strain).sum((1, 2))
    torch.testing.assert_close(LinearMaterial(torch.tensor(7e5)).psi(i1, i2), expected)


def test_materials_agree_at_small_strain(random_states):
    states = random_states(40)
    small = states.replace(
        length=states.reference_length + 1e-4 * (states.length - states.reference_length),
        twist=1e-4 * states.twist,
        pressure=1e-4 * states.pressure,
    )
    nonlinear, linear = (build_model(name, VALUES)(small).loads for name in ("continuum", "continuum_linear_material"))
    torch.testing.assert_close(linear, nonlinear, rtol=1e-2, atol=1e-3 * float(nonlinear.detach().abs().max()))


def test_a_thin_wall_needs_no_quadrature(random_states):
    states = random_states(40)
    errors = []
    for share in (0.2, 0.02):
        thin = states.replace(outer_radius=states.inner_radius * (1 + share), pressure=states.pressure * share / 4)
        thick, membrane = (build_model(name, VALUES)(thin) for name in ("continuum", "continuum_thin_wall"))
        ok = (thick.status == Status.OK) & (membrane.status == Status.OK)
        assert ok.sum() > 20
        scale = thick.loads[ok].detach().abs().amax(0)
        errors.append(float(((membrane.loads - thick.loads).detach()[ok] / scale).abs().max()))
    # The midpoint rule errs with the square of the wall.
    assert errors[1] < errors[0] / 30


def test_an_inextensible_fiber_without_a_wall_is_the_linear_models_fluid(random_states):
    """The linear model's volume comes from an inextensible fiber; both must press and turn alike."""
    states = random_states(80)
    bare = build_model("continuum_inextensible", {"C1": 1e-6})(states)
    fluid = build_model("linear", {"ka": 1e-9, "kb": 1e-12, "kc": 0.0})(states)
    ok = (bare.status == Status.OK) & (fluid.status == Status.OK)
    assert ok.sum() > 30
    torch.testing.assert_close(bare.loads[ok], fluid.loads[ok], rtol=1e-7, atol=1e-8)


def test_stiff_fibers_become_inextensible_in_a_thin_wall(random_states):
    states = random_states(80)
    thin = states.replace(outer_radius=states.inner_radius * 1.01, pressure=states.pressure / 10)
    # Only fibers that the state does not stretch: others would make the stiff model's loads grow without bound.
    rigid = build_model("continuum_inextensible", {"C1": 1e5})(thin)
    stiff = build_model("continuum_thin_wall", {"C1": 1e5, "C2": 1e12})(thin)
    ok = (rigid.status == Status.OK) & (stiff.status == Status.OK)
    assert ok.sum() > 20
    scale = rigid.loads[ok].detach().abs().amax(0)
    assert float(((stiff.loads - rigid.loads)[ok] / scale).detach().abs().median()) < 0.02
    assert math.isfinite(float(stiff.loads[ok].detach().sum()))
