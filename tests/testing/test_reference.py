"""The package against the reference bed, which was written apart from it: the effects whose definitions are subtle."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import torch
from nightly import usually

from freelearn.data.states import States, kinematic_state
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import literature, total_energy
from freelearn.testing.reference.backlash import bracketed_zero, rubbed, settled
from freelearn.testing.reference.laboratory import Laboratory, measure, protocol, random_actuators
from freelearn.testing.reference.material_points import Points
from freelearn.testing.reference.remembering_walls import Law, Memory, loads, radius_squared, remembered
from freelearn.testing.reference.total_energy import bed_loads, nominal, state_of

MATERIAL = {"C1": 1e6, "C2": 4e7}
ACTUATORS = {1: (36.0, 98.42, 4.77, 6.74), 2: (62.0, 99.0, 4.77, 6.36)}
SILENT = dict.fromkeys(("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm"), 0.0)
CASES = {
    "play": {"twist_slack": {"angle": 0.2}},
    "play with friction": {
        "twist_slack": {"angle": 0.2},
        "friction_hysteresis": {"force": 0.5, "moment": 5e-3},
    },
    "play on a soft shaft": {"twist_slack": {"angle": 0.2}, "twist_compliance": {"compliance": 0.2}},
    "relaxation": {"relaxation": {"share": 0.2, "time": 45.0}},
    "softening and friction": {
        "stress_softening": {"depth": 0.2, "severity": 0.02},
        "friction_hysteresis": {"force": 0.5, "moment": 5e-3},
    },
    "all of it": {
        "twist_slack": {"angle": 0.1},
        "relaxation": {"share": 0.2, "time": 45.0},
        "stress_softening": {"depth": 0.1, "severity": 0.02},
        "twist_offset": {"angle": 0.05},
    },
}


# Looked for step by step; each part of it is asked of others.
LONG = ["play on a soft shaft"]


@pytest.mark.parametrize("case", usually(*(name for name in CASES if name not in LONG), nightly=LONG))
def test_both_write_the_same_physics(case):
    effects = CASES[case]
    table = nominal([4], 0.03, np.random.default_rng(3))
    table["twist_deg"] *= 0.2
    expected, found = bed_loads(state_of(table), MATERIAL["C1"], MATERIAL["C2"], effects)
    values = {f"{effect}.{name}": v for effect, parameters in effects.items() for name, v in parameters.items()}
    model = build_model("continuum", MATERIAL | values, list(effects))
    with torch.no_grad():
        loads, status = model(States.from_table(table))
    assert found.all()
    assert (status == 0).all()
    np.testing.assert_allclose(loads.numpy(), expected, rtol=1e-6, atol=1e-7)
    if "twist_slack" in effects:
        resting = np.abs(expected[:, 1]) < 1e-7
        assert 0 < resting.sum() < len(resting) or "friction_hysteresis" in effects


def loads_of(table, effects, rig=total_energy.on_the_rig):
    return bed_loads(state_of(table), *MATERIAL.values(), effects, rig=rig)[0]


@pytest.fixture(scope="module")
def short():
    """Few states of two actuators, five pressures up and two down."""
    return protocol(Laboratory(states=6), ACTUATORS, np.random.default_rng(5))


NOTHING = {
    "stress_softening": {"inverse_r": 0.0, "energy": 0.05},
    "relaxation": {"share": 0.0, "time": 45.0},
    "friction_hysteresis": {"force": 0.0, "moment": 0.0},
    # A contact as stiff as to be rigid: without a gap it would be a compliance.
    "twist_slack": {"angle": 0.0, "stiffness": 1e9},
    "fiber_dispersion": {"kappa": 0.0},
}


@pytest.mark.parametrize("effect", NOTHING)
def test_the_literatures_form_of_nothing_is_nothing(effect, short):
    found = loads_of(short, {effect: NOTHING[effect]}, literature.on_the_rig)
    np.testing.assert_allclose(found, loads_of(short, {}), rtol=1e-7, atol=1e-8)
    assert set(literature.grown(effect, 1.0)) >= set(NOTHING[effect])


def test_without_history_the_points_give_the_beds_loads(short):
    """C and ∂Ψ/∂C at material points against the total energy: every energy at once."""
    effects = {
        "second_invariant": {"C01": 1e5},
        "wall_stiffening": {"C20": 1e5},
        "limited_extensibility": {"beta": 0.3},
        "fiber_stiffening": {"k2": 5.0},
        "fiber_tension_only": {"share": 0.5},
        "end_clamps": {"clamp_length": 2e-3},
        "length_compliance": {"compliance": 1e-6},
    }
    expected = loads_of(short, effects)
    np.testing.assert_allclose(loads_of(short, effects, literature.on_the_rig), expected, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("kappa", [0.003, 0.05, 0.3])
def test_the_mean_over_scattered_fibers_is_the_structure_tensor(kappa, short):
    effects = {"fiber_dispersion": {"kappa": kappa}}
    expected = loads_of(short, effects)
    np.testing.assert_allclose(loads_of(short, effects, literature.on_the_rig), expected, rtol=1e-6, atol=1e-6)
    # Energies of single fibers are another thing: their variance is not small beside the effect.
    each = loads_of(short, {"fiber_dispersion": {"kappa": kappa, "each_fiber": 1.0}}, literature.on_the_rig)
    assert (each - expected).std() > 0.5 * (expected - loads_of(short, {})).std()


def test_relaxation_at_a_held_pressure_is_the_packages_to_first_order(short):
    """Nothing is added after the move, so all stresses are equally old. What creeps meanwhile is of second order."""
    held = short.assign(pressure_kpa=30.0)
    plain, effects = loads_of(held, {}), {"relaxation": {"share": 1e-3, "time": 45.0}}
    change = loads_of(held, effects, literature.on_the_rig) - plain
    expected = loads_of(held, effects) - plain
    np.testing.assert_allclose(change, expected, atol=5e-3 * np.abs(expected).max())


def test_relaxation_is_the_convolution_with_every_step_of_stress(short):
    """The recursion from row to row against the sum over all steps, ΔSᵉ(t_j) (1 − g (1 − e^(−(t_k − t_j)/τ)))."""
    g, tau = 0.3, 45.0
    s, law = state_of(short), Law(*MATERIAL.values(), {"relaxation": {"share": g, "time": tau}})
    points = Points.from_state(s, law.fx)
    memory = remembered(points, law, s)
    u, _ = radius_squared(points, law, memory)
    elastic = points.stress(points.strain(points.length, points.twist, u), law.c1, law.c2, law.fx)
    for k in (6, 10, 13):
        first = k - k % 7
        steps = np.diff(elastic[:, first : k + 1], axis=1, prepend=0.0)
        age = s["dwell"][k] - s["dwell"][first : k + 1]
        relaxed = (steps * (1 - g * (1 - np.exp(-age / tau)))[None, :, None]).sum(1)
        np.testing.assert_allclose(elastic[:, k] + memory.left[:, k], relaxed, atol=1e-8 * np.abs(relaxed).max())


def test_softening_remembers_row_by_row(short):
    """All rows at once, until they agree, against one row after the other."""
    s, law = state_of(short), Law(*MATERIAL.values(), {"stress_softening": {"inverse_r": 0.4, "energy": 0.05}})
    points = Points.from_state(s, law.fx)
    found = loads(points, law, remembered(points, law, s))[0]
    assert np.abs(found - loads_of(short, {})).max() > 0.1 * np.abs(found).max()
    most = np.zeros((1, points.radius.shape[1]))
    for k in range(len(short)):
        if k and s["sample"][k] != s["sample"][k - 1]:
            most = np.zeros_like(most)
        row, memory = points[np.array([k])], Memory(most, np.zeros((4, *most.shape)))
        np.testing.assert_allclose(loads(row, law, memory)[0][0], found[k], rtol=1e-7, atol=1e-8)
        u, _ = radius_squared(row, law, memory)
        most = np.maximum(most, law.energy(row, row.strain(row.length, row.twist, u)))


def test_softening_far_below_the_worst_is_the_packages():
    """There the error function and the hyperbolic tangent are one, and every point of the wall lost as much."""
    table = protocol(Laboratory(states=2), {1: ACTUATORS[1]}, np.random.default_rng(0))
    table["elongation_mm"] = np.repeat([5.0, 1.0], 7)
    table["twist_deg"] = np.repeat([100.0, 10.0], 7)
    found = loads_of(table, {"stress_softening": {"inverse_r": 0.2, "energy": 1e-3}}, literature.on_the_rig)
    expected = loads_of(table, {"stress_softening": {"depth": 0.2, "severity": 1e-4}})
    np.testing.assert_allclose(found[7:], expected[7:], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(found[0], loads_of(table, {})[0], rtol=1e-8)


def test_friction_builds_up_as_dahls_equation_says(short):
    pressure = np.array([0.0, 1e3, 5e3, 5e3, 4e3, 9e3, 0.0])
    first = np.array([True, *[False] * 6])
    found = rubbed(pressure, first, 2e3)
    share = 0.0
    for k, (low, high) in enumerate(pairwise(pressure), start=1):
        path = np.linspace(low, high, 20001)
        for step in np.diff(path):
            share += (step - share * abs(step)) / 2e3
        assert found[k] == pytest.approx(share, abs=1e-3)
    # Pressure steps of 18 kPa and more are nine sliding distances: Coulomb's constant within 2 e⁻⁹.
    effects = {"friction_hysteresis": {"force": 0.5, "moment": 5e-3}}
    expected = loads_of(short, effects)
    np.testing.assert_allclose(loads_of(short, effects, literature.on_the_rig), expected, atol=2 * 0.5 * np.exp(-9.0))


def test_play_is_taken_up_against_the_contact():
    """A spring −K φ rests at zero where the gap reaches it, else at the gap's edge, the contact giving way by M/k."""
    gap, spring, stiffness = 0.1, 0.5, 100.0
    rig, sample = np.array([0.0, 0.05, 0.4, 0.08, -0.3, 0.2]), np.array([1, 1, 1, 1, 1, 2])
    found = settled(rig, sample, gap, stiffness, lambda twist: -spring * twist)
    edge = np.sign(rig) * np.maximum(np.abs(rig) - gap, 0)
    np.testing.assert_allclose(found, edge * stiffness / (stiffness + spring), atol=1e-9)


def test_play_keeps_an_actuator_on_its_side_until_the_gap_drives_it_over():
    """A moment that drives away from zero has two places of rest in the gap: which one, the path decides."""

    def moment(twist):
        return twist - twist**3 / 0.04  # rests at ±0.2

    rig = np.array([0.3, 0.05, -0.05, -0.5, -0.05, 0.05])
    found = settled(rig, np.ones(6), 0.4, 1e6, moment)
    np.testing.assert_allclose(found, [0.2, 0.2, 0.2, -0.2, -0.2, -0.2], atol=1e-6)


def test_play_on_a_rigid_contact_is_the_packages():
    """Where the moment falls with twist there is but one place of rest."""
    table = nominal([4], 0.015, np.random.default_rng(3))
    table["twist_deg"] *= 0.2
    found = loads_of(table, {"twist_slack": {"angle": 0.2, "stiffness": 1e7}}, literature.on_the_rig)
    np.testing.assert_allclose(found, loads_of(table, {"twist_slack": {"angle": 0.2}}), atol=1e-5)


def test_zeros_are_found_where_functions_bend_end_or_begin():
    def functions(x):
        with np.errstate(invalid="ignore"):
            return np.array([x[0] ** 9 - 0.5, 0.5 - np.sqrt(2 - x[1]), x[2], x[3]])

    low, high = np.array([0.0, 0.0, -1.0, -2.0]), np.array([10.0, 10.0, 3.0, 0.0])
    zeros = bracketed_zero(functions, low, high, 1e-13)
    np.testing.assert_allclose(zeros, [0.5 ** (1 / 9), 1.75, 0.0, 0.0], atol=1e-12)


def test_slips_are_where_they_are_said_to_be():
    accuracy = dict(zip(SILENT, (0.07, 0.17, 0.15, 0.03, 0.6), strict=True))
    kinds = ("other_row", "sign", "decimal", "unit", "stuck")
    laboratory = Laboratory(states=30, slipped=0.1, kinds=kinds)
    slipped, right = (
        measure(how, ACTUATORS, *MATERIAL.values(), {}, accuracy, 4) for how in (laboratory, Laboratory(states=30))
    )
    loads_read = ["force_n", "moment_nmm"]
    change = slipped.table[loads_read].to_numpy() - right.table[loads_read].to_numpy()
    expected = np.zeros_like(change)
    for slip in slipped.slips.to_dict("records"):
        expected[slip["row"], loads_read.index(slip["load"])] = slip["displacement"]
        sigma = accuracy[slip["load"]]
        assert slip["sensor_sigmas"] == pytest.approx(abs(slip["displacement"]) / sigma)
        assert slip["all_sigmas"] < slip["sensor_sigmas"]
        if slip["kind"] == "sign":
            assert slip["displacement"] == pytest.approx(-2 * right.table[slip["load"]][slip["row"]])
    np.testing.assert_allclose(change, expected, atol=1e-9)
    usable = (right.table["buckled"] == 0).sum()
    assert len(slipped.slips) == slipped.slips["row"].nunique() == round(0.1 * usable)
    assert set(slipped.slips["kind"]) == set(kinds)
    assert right.slips.empty
    pd.testing.assert_frame_equal(slipped.table.drop(columns=loads_read), right.table.drop(columns=loads_read))
    least = Laboratory(states=4, slipped=1e-4)
    assert len(measure(least, ACTUATORS, *MATERIAL.values(), {}, accuracy, 4).slips) == 1


@pytest.mark.parametrize("tails", [np.inf, 4.0])
def test_noise_has_the_stated_deviation_whatever_its_tails(tails):
    """Of 2,800 readings. The deviation of Student's t with 4 degrees of freedom is itself told poorly: within 12 %."""
    accuracy = SILENT | {"force_n": 0.03}
    laboratory = Laboratory(states=200, tails=tails)
    noise, silent = (
        measure(laboratory, ACTUATORS, *MATERIAL.values(), {}, a, 4).table["force_n"] for a in (accuracy, SILENT)
    )
    z = (noise - silent) / 0.03
    assert z.std() == pytest.approx(1, abs=0.12 if tails == 4 else 0.05)
    assert (z.abs().max() > 5) == (tails == 4)
    large = silent.abs() > 0.5 * silent.abs().max()
    grown = measure(replace(laboratory, growth=2.0), ACTUATORS, *MATERIAL.values(), {}, accuracy, 4).table["force_n"]
    assert 2 < ((grown - silent) / 0.03)[large].std() < 3.1


def test_a_laboratory_measures_as_it_says():
    made = random_actuators(40, np.random.default_rng(1))
    gamma, length, inner, outer = np.array(list(made.values())).T
    for values, low, high in ((gamma, 15, 76), (length, 80, 150), (inner, 3, 7), (outer / inner, 1.245, 1.405)):
        assert low <= values.min() < values.max() <= high
    laboratory = Laboratory(states=9, pressures=4, falling=1, order="sorted", misstated=3.0)
    table = protocol(laboratory, ACTUATORS, np.random.default_rng(2))
    assert len(table) == 2 * 9 * 5
    assert len(np.unique(kinematic_state(table))) == 2 * 9
    np.testing.assert_allclose(table["pressure_kpa"][:5], np.array([0, 1, 2, 3, 0]) * 72.5 / 3)
    places = table[table["sample"] == 2].iloc[::5][["elongation_mm", "twist_deg"]]
    assert places.apply(tuple, axis=1).is_monotonic_increasing
    # The same memory as the package's states have.
    memory, states = state_of(table), States.from_table(table)
    np.testing.assert_allclose(memory["dwell"], states.dwell.numpy())
    np.testing.assert_allclose(memory["past_severity"], states.past_severity.numpy())
    assert laboratory.told({"force_n": 0.03}) == {"force_n": pytest.approx(0.09)}
