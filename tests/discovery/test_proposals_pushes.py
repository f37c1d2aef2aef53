"""What a push at each place of the chain does to the readings, against differences in the second test bed's physics."""

import numpy as np
import pytest
import torch
from hidden_beds import BLOCK, model_of, rows_of, table_of
from hidden_tables import MATERIAL
from linear_bed import TRUE, LinearBed, bench
from outside_tables import asked, measured

from freelearn.discovery.fits.white_fit import evaluated
from freelearn.discovery.proposals.pushes import FEWEST_VISITS, places_of, pushes
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.models.build import build_model
from freelearn.physics.written.places import PLACES
from freelearn.testing.reference import total_energy

PLACE = {place.name: place for place in PLACES}
# Of the second bed's arrays, what is pushed and by how far: m, rad, Pa.
STEPS = {
    "boundary length": (("length",), 1e-6),
    "boundary twist": (("twist",), 1e-5),
    "boundary pressure": (("pressure",), 10.0),
    "geometry fiber_angle": (("gamma",), 1e-5),
    "geometry outer_radius": (("outer",), 1e-7),
    "geometry reference_length": (("reference",), 1e-6),
    "geometry active_length": (("reference", "length"), 1e-6),
}


def seen_at(question, values):
    """Pushes of the question's model at these parameters, and the rows."""
    model = question.build([])
    model.set_values(values)
    fit = evaluated(model, question.rows, model.vector().detach())
    return pushes(fit, question.rows, question.build), fit


@pytest.fixture(scope="module")
def tube():
    table = measured(states=8, pressures=3).table
    seen, fit = seen_at(asked(table), dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    return table, seen, fit


@pytest.mark.parametrize("place", STEPS)
def test_a_push_moves_the_readings_as_the_second_bed_says(tube, place):
    """By central differences there: other quadrature, another equilibrium."""
    table, seen, _ = tube
    s = total_energy.state_of(table)
    names, step = STEPS[place]
    ends = [total_energy.ideal_loads(s | {n: s[n] + h for n in names}, *MATERIAL, {})[0] for h in (step, -step)]
    slope = (ends[0] - ends[1]) / (2 * step)
    found = seen.by[place].numpy()
    assert found.shape == (len(table), 2, 1)
    for load in (0, 1):
        np.testing.assert_allclose(found[:, load, 0], slope[:, load], atol=1e-3 * np.abs(slope[:, load]).max())


def test_a_push_at_a_load_cell_or_beside_the_actuator_is_itself(tube):
    table, seen, fit = tube
    for place, column in (("measurement force", 0), ("measurement moment", 1), ("parallel axial", 0)):
        expected = np.zeros((len(table), 2))
        expected[:, column] = 1
        np.testing.assert_allclose(seen.by[place][:, :, 0], expected, atol=1e-12)
    direction = total_energy.state_of(table)["direction"]
    np.testing.assert_allclose(seen.by["dissipation moment"][:, 1, 0], -direction, atol=1e-12)
    # At no pressure the whole of the loads is the wall's.
    rest = np.flatnonzero(table["step"] == 0)
    quiet = np.abs(table["pressure_kpa"].to_numpy()[rest]) < 0.05
    np.testing.assert_allclose(
        seen.by["dissipation wall"].numpy()[rest[quiet], :, 0],
        fit.shown.numpy()[rest[quiet]],
        rtol=0.05,
        atol=0.02 * np.abs(fit.shown.numpy()[:, 0]).max(),
    )


def test_places_are_those_of_the_models_family_and_nothing_stays_registered(tube):
    table, seen, fit = tube
    rows = asked(table).rows
    assert set(seen.by) == {p.name for p in PLACES if not (p.energy or p.potential)}
    assert all(torch.isfinite(by).all() for by in seen.by.values())
    network = build_model("mlp")
    assert {p.port for p in places_of(network, rows)} == {"boundary", "dissipation", "measurement"}
    assert not [name for name in EFFECTS if "constant" in name]
    assert places_of(fit.model, rows) == list(PLACES)


def test_what_goes_against_the_direction_is_no_place_of_rows_that_only_rise(tube):
    """Force lost as the pressure rises would be one more name for what a load cell shows."""
    table, _, fit = tube
    rising = asked(table[total_energy.state_of(table)["direction"] >= 0]).rows
    assert set(PLACES) - set(places_of(fit.model, rising)) == {p for p in PLACES if p.rubs} != set()


def test_inputs_are_the_tables_and_count_in_round_numbers_as_large(tube):
    table, seen, fit = tube
    np.testing.assert_allclose(seen.inputs["twist"][:, 0], np.deg2rad(table["twist_deg"]), rtol=1e-12)
    np.testing.assert_allclose(seen.inputs["elongation"][:, 0], 1e-3 * table["elongation_mm"], atol=1e-15)
    np.testing.assert_allclose(seen.inputs["pressure"][:, 0], 1e3 * table["pressure_kpa"], rtol=1e-12)
    np.testing.assert_allclose(seen.inputs["force"][:, 0], fit.shown[:, 0], rtol=1e-12)
    for name, scale in seen.scales.items():
        largest = float(seen.inputs[name].abs().max())
        # One digit: within half of its last.
        assert 1 / 1.5 <= largest / scale <= 1.5, name
        assert float(f"{scale:.0e}") == scale


def strains(s) -> dict[str, np.ndarray]:
    """Of the second bed's wall at a hundred radii, what I₁ and I₄ exceed rest by: (N, 99) each."""
    u = total_energy.inflated(s, *MATERIAL, {})[0]
    radius = s["inner"][:, None] + (s["outer"] - s["inner"])[:, None] * np.linspace(0.01, 0.99, 99)
    axial, rate = (s["length"] / s["reference"])[:, None], (s["twist"] / s["reference"])[:, None]
    square = (radius**2 - s["inner"][:, None] ** 2) / axial + u[:, None]
    sine, cosine = np.sin(s["gamma"])[:, None], np.cos(s["gamma"])[:, None]
    i1 = (radius / axial) ** 2 / square + square * (1 / radius**2 + rate**2) + axial**2
    i4 = square * (sine / radius + rate * cosine) ** 2 + (axial * cosine) ** 2
    return {"i1": i1 - 3, "i4": i4 - 1}


def test_the_walls_strains_are_those_of_the_second_beds_wall(tube):
    """Somewhere in the wall: the inner and the outer layer hold the largest."""
    table, seen, _ = tube
    for name, value in strains(total_energy.state_of(table)).items():
        there = seen.inputs[name][:, 0].numpy()
        # Between the layers that are looked at it grows a little more.
        largest = np.abs(value).max(1)
        assert (np.abs(there) <= 1.01 * largest + 1e-6).all()
        assert (np.abs(there) >= 0.8 * largest - 1e-4).all()


def test_under_a_dead_load_strains_are_those_of_where_the_actuator_hangs():
    """Not of where the search for that begins: they say what an energy's invariants count in."""
    table = table_of("dead_load", seed=3, coarse=2)
    model, rows = model_of(table), rows_of(table)
    model.set_values(dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    fit = evaluated(model, rows, model.vector().detach())
    seen = pushes(fit, rows, lambda names: model_of(table, names))
    states = rows.states
    hung = {"length": states.reference_length + fit.shown[:, 0], "twist": fit.shown[:, 1], "gamma": states.fiber_angle}
    hung |= {"reference": states.reference_length, "inner": states.inner_radius, "outer": states.outer_radius}
    hung |= {"pressure": states.pressure}
    for name, value in strains({n: v.numpy() for n, v in hung.items()} | {"dwell": np.zeros(len(states))}).items():
        assert seen.scales[name] == pytest.approx(np.abs(value).max(), rel=0.5)


def test_an_end_block_has_a_column_for_each_actuator():
    """The block's derivative by a pressure that errs in all actuators alike is the sum of its columns."""
    table = table_of(BLOCK, coarse=3)
    rows = rows_of(table)
    model = model_of(table)
    model.set_values(dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    fit = evaluated(model, rows, model.vector().detach())
    seen = pushes(fit, rows, lambda names: model_of(table, names))
    h = 10.0
    ends = []
    for side in (1, -1):
        members = tuple(m.replace(pressure=m.pressure + side * h) for m in rows.states.members)
        with torch.no_grad():
            ends.append(model(rows.states.replace(members=members)).loads)
    whole = ((ends[0] - ends[1]) / (2 * h)).numpy()
    each = seen.by["boundary pressure"]
    assert each.shape == (len(rows), 2, 3)
    np.testing.assert_allclose(each.sum(-1), whole, rtol=1e-4, atol=1e-6 * np.abs(whole).max())
    for n in range(3):
        members = list(rows.states.members)
        ends = []
        for side in (1, -1):
            members[n] = rows.states.members[n].replace(pressure=rows.states.members[n].pressure + side * h)
            with torch.no_grad():
                ends.append(model(rows.states.replace(members=tuple(members))).loads)
        slope = ((ends[0] - ends[1]) / (2 * h)).numpy()
        np.testing.assert_allclose(each[:, :, n], slope, rtol=1e-4, atol=1e-6 * np.abs(slope).max())
        np.testing.assert_allclose(seen.inputs["pressure"][:, n], 1e3 * table[f"pressure_{n + 1}_kpa"], rtol=1e-9)
    # What the block's cells show is the block's, once.
    assert seen.by["measurement force"].shape == (len(rows), 2, 1)


def test_springs_and_a_piston_are_pushed_as_their_numbers_say():
    made = bench(0, **{"states": 6})
    model = LinearBed([])
    model.set_values(dict(zip(("stiffness", "torsion", "area", "turn"), TRUE, strict=True)))
    rows = made.rows
    fit = evaluated(model, rows, model.vector().detach())
    seen = pushes(fit, rows, lambda names: LinearBed(make_effects(names, LinearBed.family)))
    for place, slope in (
        ("boundary length", (-TRUE[0], 0.0)),
        ("boundary twist", (0.0, -TRUE[1])),
        ("boundary pressure", (TRUE[2], TRUE[3])),
        ("geometry reference_length", (TRUE[0], 0.0)),
        ("geometry outer_radius", (0.0, 0.0)),
    ):
        expected = np.broadcast_to(slope, (len(rows), 2))
        np.testing.assert_allclose(seen.by[place][:, :, 0], expected, rtol=1e-9, atol=1e-15)
    assert "i1" not in seen.inputs


def test_rows_without_a_clock_have_no_time_to_depend_on(tube):
    table, seen, fit = tube
    question = asked(table)
    assert "time" in seen.inputs
    assert set(pushes(fit, question.rows, question.build, clocked=False).inputs) == set(seen.inputs) - {"time"}


def test_a_time_that_only_numbers_a_few_states_is_none_to_depend_on():
    values = dict(zip(("C1", "C2"), MATERIAL, strict=True))
    for states, there in ((4, False), (FEWEST_VISITS, True)):
        seen, _ = seen_at(asked(measured(samples=(3,), states=states, pressures=3).table), values)
        assert ("time" in seen.inputs) == there
