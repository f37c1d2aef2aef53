"""Actuators that lean and walls that lag behind, in the reference bed and in the package: written apart, and equal."""

import numpy as np
import pytest
from compared import C1, C2, DESIGNS, PRESSURES, SILENT, assert_near, table_of, told
from nightly import usually

from freelearn.data.beds import BEDS
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.testing.reference import lagging_walls, leaning, literature, other_beds, total_energy
from freelearn.testing.reference.truths import DIRECTED, MOVED, grown
from freelearn.testing.small_tables import visits

FAR, LAG = {"off_axis": {"squared_distance": 4e-4}}, {"viscoelasticity": {"share": 0.3, "time": 60.0}}
CASES = {
    "off_axis": FAR,
    "viscoelasticity": LAG,
    "both": FAR | LAG,
    "a lagging gauge": {"pressure_hysteresis": {"pressure": 2e3}, "pressure_gain": {"gain": 0.05}},
    "rubbed by the moves": {
        "motion_friction": {"force": 0.8, "moment": 8e-3},
        "friction_hysteresis": {"force": 0.3, "moment": 5e-3},
    },
    "on a soft mount, with a wrong gauge": {
        **FAR,
        "length_offset": {"length": 1e-3},
        "twist_offset": {"angle": 0.1},
        "length_compliance": {"compliance": 2e-5},
        "twist_compliance": {"compliance": 0.1},
        "threshold_pressure": {"pressure": 3e3},
    },
    "with play and friction": {
        **FAR,
        **LAG,
        "twist_slack": {"angle": 0.1},
        "friction_hysteresis": {"force": 0.5, "moment": 5e-3},
        "end_taper": {"ratio": 2.0},
    },
    "beside what else a wall remembers": {
        **LAG,
        "relaxation": {"share": 0.2, "time": 45.0},
        "stress_softening": {"depth": 0.2, "severity": 0.02},
        "end_clamps": {"clamp_length": 2e-3},
    },
}


def loads_of(table, fx, rig=total_energy.on_the_rig) -> np.ndarray:
    loads, balanced = total_energy.bed_loads(total_energy.state_of(table), C1, C2, fx, rig=rig)
    assert balanced.all()
    return loads


@pytest.mark.parametrize("make", usually("both", nightly=[make for make in DESIGNS if make != "both"]))
@pytest.mark.parametrize("case", CASES)
def test_the_reference_and_the_package_agree(case, make):
    table, fx = table_of(make), CASES[case]
    expected = loads_of(table, fx)
    assert_near(told(table.assign(force_n=0.0, moment_nmm=0.0, buckled=0), fx), expected)
    without = {name: values for name, values in fx.items() if name not in {*MOVED, *DIRECTED}}
    bare = loads_of(table, without)
    assert (np.abs(expected - bare).max(0) > 1e-3 * np.ptp(bare, axis=0)).any()


@pytest.mark.parametrize("kind", ["isometric", "inflation", "dead_load"])
@pytest.mark.parametrize("case", ["off_axis", "viscoelasticity", "a lagging gauge", "rubbed by the moves"])
def test_they_agree_on_the_other_beds(case, kind):
    """Under a dead load a wall that lags is refused, and where an actuator rests is known to difference quotients."""
    if kind == "dead_load" and case in ("viscoelasticity", "rubbed by the moves"):
        return
    fx = CASES[case]
    table = other_beds.measure(kind, table_of("braid", kind), C1, C2, fx, 0, SILENT)
    table = table[table["buckled"] == 0]
    assert len(table) > 50
    there = [i for i, q in enumerate(BEDS[kind].readings) if q in BEDS[kind].measured]
    expected = Rows.from_table(table).loads[:, there]
    assert_near(told(table, fx)[:, there], expected, 1e-5 if kind == "dead_load" else 1e-6)


@pytest.mark.parametrize("count", [2, 3])
def test_both_remember_the_same_moves(count):
    table = visits(count=count)
    s, states = total_energy.state_of(table), States.from_table(table)
    np.testing.assert_allclose(s["moved_length"], states.moved_length.numpy(), atol=1e-15)
    np.testing.assert_allclose(s["moved_twist"], states.moved_twist.numpy(), atol=1e-15)
    assert np.abs(s["moved_twist"]).max() > 0.1


# --- leaning --------------------------------------------------------------------------------------------------


def test_pivots_on_the_axis_are_a_length_apart_and_beside_it_farther():
    """A quarter turn 30 mm beside the axis moves the head √2 · 30 mm aside."""
    length, twist = np.array([0.1, 0.04]), np.array([0.7, np.pi / 2])
    np.testing.assert_array_equal(leaning.pivots_apart(length, twist, 0.0), length)
    assert leaning.pivots_apart(length, twist, 0.03)[1] == pytest.approx(np.sqrt(0.04**2 + 2 * 0.03**2))


def test_a_leaning_actuator_gives_the_block_the_work_that_it_does():
    """Of the reference's own rig: ∮ F dl + M dφ on a circle in (l, φ) at fixed pressure is nothing, with a lever."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    gamma, reference, inner, outer = total_energy.SAMPLES[3]
    rows = {"gamma": np.deg2rad(gamma), "reference": reference * 1e-3, "inner": inner * 1e-3, "outer": outer * 1e-3}
    s = {name: np.full(64, value) for name, value in rows.items()}
    s |= {"pressure": np.full(64, 6e4), "direction": np.zeros(64), "clock": np.zeros(64)}
    s |= {"length": s["reference"] + 2e-3 * np.cos(angle), "twist": 0.8 + 0.5 * np.sin(angle)}
    path = np.stack([-2e-3 * np.sin(angle), 0.5 * np.cos(angle)], axis=1)

    def work(loads) -> float:
        return float((loads * path).sum() * 2 * np.pi / 64)

    assert abs(work(total_energy.bed_loads(s, C1, C2, FAR)[0])) < 1e-9
    without_lever, _ = total_energy.on_the_rig(leaning.leaned(s, FAR), C1, C2, {})
    assert abs(work(without_lever)) > 1e-4


# --- lagging --------------------------------------------------------------------------------------------------


def test_superposition_is_the_integral_of_the_relaxation_function():
    """∫ G(t − s) dw(s) with G = g e^(−t/τ), steps at known times: by hand."""
    wall = np.array([[1.0, 5.0], [1.0, 5.0], [4.0, 5.0], [4.0, 5.0], [2.0, 6.0], [9.0, 9.0]])
    sample, clock = np.array([1, 1, 1, 1, 1, 2.0]), np.array([0.0, 20.0, 50.0, 70.0, 100.0, 0.0])
    found = lagging_walls.overstress(wall, sample, clock, 0.2, 40.0)
    fade = [np.exp(-x / 40.0) for x in (20.0, 50.0)]
    expected = 0.2 * np.array([[0, 0], [0, 0], [3, 0], [3 * fade[0], 0], [3 * fade[1] - 2, 1], [0, 0]])
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_it_solves_the_standard_linear_solids_equation():
    """Zener's solid: dh/dt = g dw/dt − h/τ, by small steps of time along a ramp that is sampled finely."""
    time = np.linspace(0, 200, 4001)
    wall = np.stack([np.sin(time / 30), np.minimum(time, 80.0)], axis=1)
    found = lagging_walls.overstress(wall, np.ones(4001), time, 0.3, 50.0)
    beside = np.zeros(2)
    for k in range(1, 4001):
        beside = beside + 0.3 * (wall[k] - wall[k - 1]) - beside * (time[k] - time[k - 1]) / 50.0
    np.testing.assert_allclose(found[-1], beside, rtol=2e-3, atol=2e-3)


def small(table, share: float = 0.05):
    """The table with moves that are small beside the actuator, where all is linear."""
    return table.assign(elongation_mm=share * table["elongation_mm"], twist_deg=share * table["twist_deg"])


def test_of_long_states_the_literatures_form_is_the_packages_to_first_order():
    """Small moves, no pressure, states of three τ and more: then only the last move counts, and the wall is linear."""
    table = small(table_of()).assign(pressure_kpa=0.0)
    fx = {"viscoelasticity": {"share": 1e-3, "time": 40.0}}
    bare = loads_of(table, {})
    expected, found = (loads_of(table, fx, rig) - bare for rig in (total_energy.on_the_rig, literature.on_the_rig))
    assert np.abs(expected).max() > 1e-5
    np.testing.assert_allclose(found, expected, atol=0.05 * np.abs(expected).max())


def test_the_literatures_form_is_another_and_neither_knows_of_moves_before_the_first():
    table = table_of()
    fx = {"viscoelasticity": grown("viscoelasticity", 3.0)}
    bare = loads_of(table, {})
    expected, found = (loads_of(table, fx, rig) - bare for rig in (total_energy.on_the_rig, literature.on_the_rig))
    assert 0.02 < np.linalg.norm(found - expected) / np.linalg.norm(found) < 0.5
    first = (table.groupby("sample").cumcount() < len(PRESSURES)).to_numpy()
    np.testing.assert_array_equal(expected[first], 0)
    np.testing.assert_allclose(found[first], 0, atol=1e-7)


def test_the_wall_lags_and_the_fluid_does_not():
    """In the literature's form what is added does not depend on the pressure that fills the actuator meanwhile."""
    empty = table_of().assign(pressure_kpa=0.0)
    added = [
        loads_of(table, LAG, literature.on_the_rig) - loads_of(table, {}, literature.on_the_rig)
        for table in (empty, empty.assign(pressure_kpa=60.0))
    ]
    assert np.abs(added[0]).max() > 0.1
    np.testing.assert_allclose(added[0], added[1], atol=1e-7)
