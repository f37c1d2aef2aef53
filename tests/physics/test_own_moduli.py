"""Tubes of several rubbers, or fibers, on one end block and as samples: against the reference physics with each's."""

import numpy as np
import pytest
import torch
from test_members import DESIGNS, HEADER, alone, block, loads, made, table_of

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.mechanics.energy import EnergySum
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.models.build import build_model
from freelearn.physics.models.rubber import Rubber, isotropic_effects
from freelearn.testing.contract_checks import batch_is_rows, members_are_alone, reciprocal
from freelearn.testing.reference import total_energy

C1, C2 = 8e5, 2e7
# Natural logarithms of each tube's modulus over the first one's, which is C1, or C2.
OWN = {1: 0.0, 2: -0.4, 3: 0.7}
MODULI = {"wall_modulus": "C1", "fiber_modulus": "C2"}
each = pytest.mark.parametrize("name", MODULI)


def labels(name):
    return {n: f"{name}.log_ratio[{n}]" for n in (2, 3)}


def several(name, **more):
    return made("continuum", [name], {label: OWN[n] for n, label in labels(name).items()}, **more)


def moduli(name, number):
    """C1 and C2 of one tube."""
    return {"C1": C1, "C2": C2} | {MODULI[name]: {"C1": C1, "C2": C2}[MODULI[name]] * np.exp(OWN[number])}


@each
def test_it_is_another_stock_in_each_tube(name):
    table = table_of(12)
    expected = np.zeros((12, 2))
    for design in DESIGNS:
        own = dict(zip(HEADER[1:], design[1:], strict=True))
        states = total_energy.state_of(table.assign(**own, pressure_kpa=table[f"pressure_{design[0]}_kpa"], time_s=0.0))
        expected += total_energy.bed_loads(states, *moduli(name, design[0]).values(), {})[0]
    found = loads(several(name), block(table))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    plain = loads(made("continuum"), block(table))
    assert float((found - plain).abs().max()) > 1


@each
def test_of_several_samples_it_is_another_stock_in_each(name):
    parts = [(design[0], alone(table_of(8), design)) for design in DESIGNS]
    values = {"C1": C1, "C2": C2} | {label: OWN[n] for n, label in labels(name).items()}
    model = build_model("continuum", values, [name], [1, 2, 3])
    for number, states in parts:
        one = states.replace(sample=torch.full_like(states.sample, number))
        expected = loads(build_model("continuum", moduli(name, number)), states)
        torch.testing.assert_close(loads(model, one), expected, rtol=1e-10, atol=1e-10)
    # One that was not fitted takes the mean of those that were.
    number, states = parts[0]
    other = states.replace(sample=torch.full_like(states.sample, 9))
    mean = {"C1": C1, "C2": C2}
    mean[MODULI[name]] *= np.exp(sum(OWN.values()) / 3)
    torch.testing.assert_close(
        loads(model, other), loads(build_model("continuum", mean), states), rtol=1e-10, atol=1e-10
    )


@each
def test_of_one_tube_alone_it_is_the_modulus_itself(name):
    states = alone(table_of(), DESIGNS[0])
    one = build_model("continuum", {"C1": C1, "C2": C2, f"{name}.log_ratio": OWN[3]}, [name])
    other = build_model("continuum", moduli(name, 3))
    torch.testing.assert_close(loads(one, states), loads(other, states), rtol=1e-11, atol=1e-11)


@each
def test_its_integral_is_that_of_its_energy(name):
    states, model = block(table_of()).side_by_side(), several(name)
    with torch.no_grad():
        term = model.effects[0].term(model.values(), states)
        u = states.inner_radius**2 * 1.05
        exact = EnergySum([term]).wall(Tube.from_states(states)).carried(u)
        by_points = EnergySum([term]).wall(Tube.from_states(states, 40)).carried(u)
    for one, other in zip(exact, by_points, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-9, atol=1e-9)


@each
def test_it_gives_back_the_work_and_is_each_members_alone(name):
    states, model = block(table_of(8)), several(name)
    reciprocal(model, states)
    batch_is_rows(model, states)
    members_are_alone(model, states)


@each
@pytest.mark.parametrize("hung", [False, True])
def test_a_fit_finds_each_modulus(name, hung):
    table = table_of(24)
    if hung:
        table = table.drop(columns=["elongation_mm", "twist_deg"]).assign(bed="dead_load")
    # Of one length, so that they hang at rest before any pressure.
    states = block(table, [(n, g, g2, 100.0, *radii) for n, g, g2, _, *radii in DESIGNS])
    with torch.no_grad():
        shown = several(name)(states)
    assert (shown.status == 0).all()
    rows, model = Rows.whole(states, shown.loads), made("continuum", [name])
    problem, (lower, upper) = Problem(model, rows), model.raw_bounds()
    solver = LevenbergMarquardt(problem.residuals, problem.jacobians, lower=lower, upper=upper, batched=True)
    model.set_vector(solver.solve(model.vector().detach()[None]).member(0).x)
    found = uncertainty(problem)
    truth = {"C1": C1, "C2": C2, **{label: OWN[n] for n, label in labels(name).items()}}
    assert dict(zip(found.names, found.values, strict=True)) == pytest.approx(truth, rel=1e-3)
    # No two of them are one number.
    assert np.isfinite(found.stderr).all()


@each
def test_a_fit_of_one_tube_or_of_values_that_all_share_is_refused(name):
    check_effects(several(name).effects, several(name).values(), block(table_of()))
    one, shared = build_model("continuum", {}, [name]), made("continuum", [name], members=0)
    for model, states in ((one, alone(table_of(), DESIGNS[0])), (shared, block(table_of()))):
        with pytest.raises(UserError, match=rf"'{name}' compares samples, or actuators.*Leave it out here"):
            check_effects(model.effects, model.values(), states)


def test_a_rubber_specimen_has_none():
    assert "wall_modulus" not in isotropic_effects()
    with pytest.raises(UserError, match="'wall_modulus' compares actuators"):
        Rubber(["wall_modulus"])
    with pytest.raises(UserError, match="'fiber_modulus' depends on the fiber"):
        Rubber(["fiber_modulus"])
