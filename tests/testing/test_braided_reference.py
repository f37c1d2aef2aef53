"""What braided muscles taught, in the reference bed and in the package: written apart, equal to 1e-6 of the loads."""

import numpy as np
import pytest
from compared import C1, C2, DESIGNS, SHARE, SILENT, assert_near, table_of, told

from freelearn.data.beds import BEDS
from freelearn.data.rows import Rows
from freelearn.physics.effects.registry import EFFECTS
from freelearn.testing.reference import braided, literature, other_beds, total_energy
from freelearn.testing.reference.truths import APART, BRAIDED, DIRECTED, MOVED, UNIT, grown

TOGETHER = {
    "everything": {name: grown(name, 1.0) for name in BRAIDED},
    "a soft mount and a wrong gauge": {
        **{name: grown(name, 2.0) for name in ("end_taper", "contact_friction", "threshold_pressure")},
        "pressure_offset": {"pressure": 1.5e3},
        "length_compliance": {"compliance": 2e-5},
        "twist_offset": {"angle": 0.05},
    },
    "a wall that remembers": {
        "bladder_stiffness": {"stiffness": 800.0},
        "second_invariant_log": {"modulus": 2e5},
        "relaxation": {"share": 0.2, "time": 45.0},
        "stress_softening": {"depth": 0.2, "severity": 0.02},
    },
    "another actuator than drawn": {
        "end_taper": {"ratio": 3.0},
        "bladder_stiffness": {"stiffness": 800.0},
        "fiber_misalignment": {"angle": 0.02},
        "wall_thickness": {"outer_radius": 1e-4},
        "end_clamps": {"clamp_length": 2e-3},
    },
}
PACKED = {name: {name: grown(name, 3.0)} for name in ("bladder_slack", "strand_jamming")}
CASES = {name: {name: grown(name, 3.0)} for name in BRAIDED} | PACKED | TOGETHER


def test_every_effect_of_the_library_can_be_hidden():
    # Those of the history act along logs, which this bed does not record.
    still = {name for name, effect in EFFECTS.items() if effect.port != "history"}
    assert {*UNIT, *BRAIDED, *MOVED, *APART, *DIRECTED} == still


@pytest.mark.parametrize("make", DESIGNS)
@pytest.mark.parametrize("case", CASES)
def test_the_reference_and_the_package_agree(case, make):
    if (case, make) == ("strand_jamming", "helix"):
        # One family is not turned far enough here for its fibers to touch.
        return
    table, fx = table_of(make), CASES[case]
    expected, balanced = total_energy.bed_loads(total_energy.state_of(table), C1, C2, fx)
    assert balanced.all()
    assert_near(told(table.assign(force_n=0.0, moment_nmm=0.0, buckled=0), fx), expected)
    # And the effect is there to be hidden.
    bare, _ = total_energy.bed_loads(total_energy.state_of(table), C1, C2, {})
    assert (np.abs(expected - bare).max(0) > 1e-3 * np.ptp(bare, axis=0)).any()


@pytest.mark.parametrize("kind", ["isometric", "inflation", "dead_load"])
@pytest.mark.parametrize("name", [*BRAIDED, *PACKED, "buckling"])
def test_they_agree_on_the_other_beds(name, kind):
    """Without noise; where an actuator comes to rest under a load is known to the reference's difference quotients."""
    if EFFECTS[name].untold(kind):
        return
    fx = {name: grown(name, 2.0)}
    table = other_beds.measure(kind, table_of("braid", kind), C1, C2, fx, 0, SILENT)
    table = table[table["buckled"] == 0]
    assert len(table) > 50
    there = [i for i, q in enumerate(BEDS[kind].readings) if q in BEDS[kind].measured]
    expected = Rows.from_table(table).loads[:, there]
    assert_near(told(table, fx)[:, there], expected, 1e-5 if kind == "dead_load" else SHARE)


# --- the literature's forms -----------------------------------------------------------------------------------


def test_points_of_two_families_give_the_beds_loads():
    """Every energy at once, on tubes of one and of two families."""
    fx = {
        **{name: grown(name, 2.0) for name in ("bladder_stiffness", "second_invariant_log", "small_strain_stiffness")},
        "second_invariant": {"C01": 1e5},
        "fiber_stiffening": {"k2": 5.0},
        "fiber_dispersion": {"kappa": 0.02},
        "end_clamps": {"clamp_length": 2e-3},
    }
    s = total_energy.state_of(table_of("both"))
    expected, _ = total_energy.bed_loads(s, C1, C2, fx)
    found, balanced = total_energy.bed_loads(s, C1, C2, fx, rig=literature.on_the_rig)
    assert balanced.all()
    assert_near(found, expected)


def differences(name: str, amount: float) -> tuple[np.ndarray, np.ndarray]:
    """The change that the literature's form makes on braids, and that of the package's."""
    s, fx = total_energy.state_of(table_of("braid")), {name: literature.grown(name, amount)}
    bare = total_energy.bed_loads(s, C1, C2, {})[0]
    return tuple(
        total_energy.bed_loads(s, C1, C2, fx, rig=rig)[0] - bare
        for rig in (literature.on_the_rig, total_energy.on_the_rig)
    )


@pytest.mark.parametrize(
    ("name", "amount"),
    [("end_taper", 3.0), ("threshold_pressure", 4.0), ("contact_friction", 2.0), ("strand_jamming", 3.0)],
)
def test_the_literatures_form_is_another_but_near(name, amount):
    """Sharp cones, a sharp threshold, friction that builds up: the package rounds off a little of the effect."""
    sharp, package = differences(name, amount)
    assert not np.allclose(sharp, package, rtol=1e-6, atol=0)
    assert np.linalg.norm(sharp - package) < 0.1 * np.linalg.norm(package)


def test_below_the_threshold_nothing_acts_at_all():
    table = table_of("braid").assign(pressure_kpa=4.0)
    s, fx = total_energy.state_of(table), {"threshold_pressure": {"pressure": 5e3}}
    found = total_energy.bed_loads(s, C1, C2, fx, rig=literature.on_the_rig)[0]
    empty = total_energy.bed_loads(s | {"pressure": 0 * s["pressure"]}, C1, C2, {}, rig=literature.on_the_rig)[0]
    np.testing.assert_array_equal(found, empty)


def test_threads_that_hardly_stretch_are_a_braid_of_inextensible_ones():
    """One family keeps its length; a braid without twist lies where either does."""
    s = total_energy.state_of(table_of("braid"))
    radius = braided.thread_radius(s, s["length"], 0 * s["twist"])
    thread = s["reference"] / np.cos(s["gamma"])
    wound = s["reference"] / s["outer"] * np.tan(s["gamma"])
    np.testing.assert_allclose((radius * wound) ** 2 + s["length"] ** 2, thread**2, rtol=1e-12)
    rest = s["length"] == s["reference"]
    assert rest.any()
    np.testing.assert_allclose(radius[rest], s["outer"][rest], rtol=1e-12)


def test_a_cone_lacks_what_it_lacks():
    """A cone from 5 to 8 mm, 6 mm long: π h (r² + r R + R²)/3 of a cylinder's π h r², twice."""
    found = braided.lost_volume(np.array([8.0]), np.array([5.0]), 2.0, 0.0)
    assert found[0] == pytest.approx(2 * np.pi * 6 * (64 - (64 + 40 + 25) / 3))
