"""An end block that tilts under unequal pushes: against the block's own two angles, written apart."""

import numpy as np
import pandas as pd
import pytest
import torch
from nightly import usually
from test_members import DESIGNS, alone, block, loads, made, table_of

from freelearn.data.beds import BED
from freelearn.data.rows import Rows
from freelearn.discovery.search.testable import candidates
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.models.build import build_model
from freelearn.testing.contract_checks import batch_is_rows, members_are_alone, parameter_derivatives, reciprocal
from freelearn.testing.reference import total_energy
from freelearn.testing.reference.other_beds import block_loads

SOFT = 2e-5
LABEL = "block_tilt.compliance"
# Three of one length on the block, so that no one pushes before any pressure does.
EVEN = [(1, 36.0, np.nan, 100.0, 4.77, 6.4), (2, -40.0, np.nan, 100.0, 4.77, 6.4), (3, 30.0, -30.0, 100.0, 4.77, 6.4)]


def tilting(name="continuum", values=None, **more):
    return made(name, ["block_tilt"], {LABEL: SOFT, **(values or {})}, **more)


@pytest.mark.parametrize("designs", [DESIGNS[:2], EVEN])
def test_it_is_the_block_that_turns_about_two_axes_on_a_spring(designs):
    table = table_of(12)
    members = []
    for design in designs:
        own = dict(
            zip(("gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"), design[1:], strict=True)
        )
        members.append(
            total_energy.state_of(table.assign(**own, pressure_kpa=table[f"pressure_{design[0]}_kpa"], time_s=0.0))
        )
    distance, spring = 0.0229, 1 / 26.0
    expected, angles = block_loads(members, 8e5, 2e7, {}, distance, spring)
    assert float(np.abs(angles).max()) > np.deg2rad(0.3)
    columns = [f"pressure_{design[0]}_kpa" for design in designs]
    rows = block(table.drop(columns=[c for c in table if c.startswith("pressure_") and c not in columns]), designs)
    found = loads(tilting(values={LABEL: spring * distance**2}, members=len(designs)), rows)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    plain = loads(made("continuum", members=len(designs)), rows)
    assert float((found - plain).abs().max()) > 0.1


def test_equal_pushes_tilt_nothing():
    table = table_of(8)
    same = table.assign(pressure_1_kpa=table["pressure_3_kpa"], pressure_2_kpa=table["pressure_3_kpa"])
    rows = block(same, [(n, *DESIGNS[0][1:]) for n in (1, 2, 3)])
    torch.testing.assert_close(loads(tilting(), rows), loads(made("continuum"), rows), rtol=1e-9, atol=1e-9)


def test_one_alone_is_lifted_as_by_a_mount_that_gives_way():
    states = alone(table_of(), DESIGNS[0])
    values = {"C1": 8e5, "C2": 2e7}
    one = build_model("continuum", values | {LABEL: SOFT}, ["block_tilt"])
    other = build_model("continuum", values | {"length_compliance.compliance": SOFT}, ["length_compliance"])
    torch.testing.assert_close(loads(one, states), loads(other, states), rtol=1e-9, atol=1e-9)


def test_a_block_that_tilts_gives_back_the_work_and_its_derivatives_are_exact():
    states, model = block(table_of(8)), tilting()
    reciprocal(model, states)
    batch_is_rows(model, states)
    members_are_alone(model, states)
    parameter_derivatives(model, states, {LABEL: 1e-9, "C1": 1e-4})
    check_effects(model.effects, model.values(), states)
    still = made("continuum", ["block_tilt"], {LABEL: 0.0})
    assert torch.equal(loads(still, states), loads(made("continuum"), states))


@pytest.mark.parametrize("hung", usually(False, nightly=[True]))
def test_a_fit_finds_it_from_none(hung):
    """Fits begin each search where the last one has ended, with the slopes seen on the way."""
    table, more = table_of(24), {"off_axis.squared_distance[1]": 4e-4}
    names = ["off_axis", "block_tilt"]
    if hung:
        table = table.drop(columns=["elongation_mm", "twist_deg"]).assign(**{BED: "dead_load"})
    states = block(table, EVEN)
    truth = made("continuum", names, {LABEL: SOFT, **more})
    with torch.no_grad():
        shown = truth(states)
    assert (shown.status == 0).all()
    rows = Rows.whole(states, shown.loads)
    model = made("continuum", names, more)
    problem, (lower, upper) = Problem(model, rows), model.raw_bounds()
    solver = LevenbergMarquardt(problem.residuals, problem.jacobians, lower=lower, upper=upper, batched=True)
    model.set_vector(solver.solve(model.vector().detach()[None]).member(0).x)
    assert model.scalars()[LABEL] == pytest.approx(SOFT, rel=1e-3)


def test_it_is_asked_of_several_actuators_alone():
    def told(states_table: pd.DataFrame, designs) -> list[str]:
        states = block(states_table, designs)
        rows = Rows.whole(states, torch.ones(len(states), 2, dtype=torch.float64))
        return candidates(made("continuum", members=len(designs)), [], states_table.columns, rows).names

    table = table_of()
    assert "block_tilt" in told(table, DESIGNS)
    single = table.drop(columns=["pressure_2_kpa", "pressure_3_kpa"])
    assert "block_tilt" not in told(single, DESIGNS[:1])
