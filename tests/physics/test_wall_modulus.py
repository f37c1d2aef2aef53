"""Tubes of several rubbers on one end block: against the reference physics with a modulus for each."""

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
# Natural logarithms of each tube's modulus over the first one's, which is C1.
OWN = {1: 0.0, 2: -0.4, 3: 0.7}
LABELS = {n: f"wall_modulus.log_ratio[{n}]" for n in (2, 3)}


def several(**more):
    return made("continuum", ["wall_modulus"], {label: OWN[n] for n, label in LABELS.items()}, **more)


def test_it_is_another_rubber_in_each_tube():
    table = table_of(12)
    expected = np.zeros((12, 2))
    for design in DESIGNS:
        own = dict(zip(HEADER[1:], design[1:], strict=True))
        states = total_energy.state_of(table.assign(**own, pressure_kpa=table[f"pressure_{design[0]}_kpa"], time_s=0.0))
        expected += total_energy.bed_loads(states, C1 * np.exp(OWN[design[0]]), C2, {})[0]
    found = loads(several(), block(table))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    plain = loads(made("continuum"), block(table))
    assert float((found - plain).abs().max()) > 1


def test_of_one_tube_alone_it_is_c1():
    states = alone(table_of(), DESIGNS[0])
    one = build_model("continuum", {"C1": C1, "C2": C2, "wall_modulus.log_ratio": 0.3}, ["wall_modulus"])
    other = build_model("continuum", {"C1": C1 * np.exp(0.3), "C2": C2})
    torch.testing.assert_close(loads(one, states), loads(other, states), rtol=1e-11, atol=1e-11)


def test_its_integral_is_that_of_its_energy():
    states, model = block(table_of()).side_by_side(), several()
    with torch.no_grad():
        term = model.effects[0].term(model.values(), states)
        u = states.inner_radius**2 * 1.05
        exact = EnergySum([term]).wall(Tube.from_states(states)).carried(u)
        by_points = EnergySum([term]).wall(Tube.from_states(states, 40)).carried(u)
    for one, other in zip(exact, by_points, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-9, atol=1e-9)


def test_it_gives_back_the_work_and_is_each_members_alone():
    states, model = block(table_of(8)), several()
    reciprocal(model, states)
    batch_is_rows(model, states)
    members_are_alone(model, states)


@pytest.mark.parametrize("hung", [False, True])
def test_a_fit_finds_each_modulus(hung):
    table = table_of(24)
    if hung:
        table = table.drop(columns=["elongation_mm", "twist_deg"]).assign(bed="dead_load")
    # Of one length, so that they hang at rest before any pressure.
    states = block(table, [(n, g, g2, 100.0, *radii) for n, g, g2, _, *radii in DESIGNS])
    with torch.no_grad():
        shown = several()(states)
    assert (shown.status == 0).all()
    rows, model = Rows.whole(states, shown.loads), made("continuum", ["wall_modulus"])
    problem, (lower, upper) = Problem(model, rows), model.raw_bounds()
    solver = LevenbergMarquardt(problem.residuals, problem.jacobians, lower=lower, upper=upper, batched=True)
    model.set_vector(solver.solve(model.vector().detach()[None]).member(0).x)
    found = uncertainty(problem)
    truth = {"C1": C1, "C2": C2, **{label: OWN[n] for n, label in LABELS.items()}}
    assert dict(zip(found.names, found.values, strict=True)) == pytest.approx(truth, rel=1e-3)
    # No two of them are one number.
    assert np.isfinite(found.stderr).all()


def test_a_fit_of_one_tube_or_of_values_that_all_share_is_refused():
    check_effects(several().effects, several().values(), block(table_of()))
    one, shared = build_model("continuum", {}, ["wall_modulus"]), made("continuum", ["wall_modulus"], members=0)
    for model, states in ((one, alone(table_of(), DESIGNS[0])), (shared, block(table_of()))):
        with pytest.raises(UserError, match=r"'wall_modulus' compares actuators on one end block.*Leave it out here"):
            check_effects(model.effects, model.values(), states)


def test_a_rubber_specimen_has_none():
    assert "wall_modulus" not in isotropic_effects()
    with pytest.raises(UserError, match="'wall_modulus' compares actuators"):
        Rubber(["wall_modulus"])
