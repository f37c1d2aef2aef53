"""Maps of a fitted model: what is drawn is what the chain gives, on every bed, of one actuator and of several."""

from dataclasses import replace
from itertools import pairwise

import beds
import numpy as np
import pandas as pd
import pytest
import torch
from small_runs import make_csv, run

import freelearn
from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD, ELONGATION, FORCE, ISOMETRIC, KINEMATIC, MOMENT, PRESSURE, TWIST
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.queries.curves.curve_rows import pressure_of
from freelearn.queries.maps.maps import load_polygon, maps, reachable_poses, stiffness_map
from freelearn.queries.maps.reach import PressureGrid, hull
from freelearn.queries.maps.stiffness_map import AXIAL, BACK, COUPLING, TORSIONAL


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Two single actuators on the kinematic bed."""
    place = tmp_path_factory.mktemp("alone")
    csv = make_csv(place / "table.csv")
    run(place / "run", "train=sample3", "data=csv", f"data.path={csv}", "figures=false")
    return freelearn.load(place / "run")


def taken_up(name, tmp_path_factory, *overrides):
    place = tmp_path_factory.mktemp(name)
    run(place / "run", "train=all", *beds.write(name, {}, place), "figures=false", *overrides)
    return freelearn.load(place / "run")


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    return taken_up("block", tmp_path_factory)


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    return taken_up("dead_load", tmp_path_factory)


@pytest.fixture(scope="module")
def muscle(tmp_path_factory):
    return taken_up("isometric", tmp_path_factory)


def loads(fitted, points):
    """Force [N] and moment [N·mm] that the chain gives at the places of some rows, whatever the run's bed."""
    answer = replace(fitted, bed=KINEMATIC).predict(points[[c for c in points if c not in ("force_n", "moment_nmm")]])
    assert set(answer.status) == {"ok"}
    return answer.loads * (1, 1e3)


def test_the_polygon_of_one_actuator_is_what_the_chain_gives_over_the_pressure(alone):
    found = load_polygon(alone, elongation_mm=1.0, twist_deg=(-20.0, 30.0))
    assert not found.several
    assert [(case.sample, case.first, case.second) for case in found.cases()] == [
        (n, 1.0, twist) for n in (3, 6) for twist in (-20.0, 30.0)
    ]
    np.testing.assert_allclose(found.points[["force_n", "moment_nmm"]], loads(alone, found.points), rtol=1e-9)
    pressures = alone.table()["pressure_kpa"]
    for case in found.cases():
        assert (case.points["pressure_kpa"].min(), case.points["pressure_kpa"].max()) == (0, pressures.max())
        assert case.lost == 0
    assert found.fitted == (3,)


def test_the_vertices_of_a_polygon_carry_the_loads_of_their_pressures_and_enclose_all(block):
    found = load_polygon(block, -1.0, 20.0)
    assert found.several
    np.testing.assert_allclose(found.points[["force_n", "moment_nmm"]], loads(block, found.points), rtol=1e-9)
    (case,) = found.cases()
    vertices = case.points.dropna(subset="vertex").sort_values("vertex")
    assert vertices["vertex"].tolist() == list(range(1, len(vertices) + 1))
    outline, every = (rows[["force_n", "moment_nmm"]].to_numpy() for rows in (vertices, case.points))
    size = np.ptp(every, axis=0)
    for one, other in pairwise([*outline, outline[0]]):
        along, toward = (other - one) / size, (every - one) / size
        assert (along[0] * toward[:, 1] - along[1] * toward[:, 0]).min() > -1e-9
    # Members 1 and 2 turn against each other: each alone makes one of the ends.
    corner = case.points.set_index("corner")["moment_nmm"]
    assert {corner.drop("").idxmin(), corner.drop("").idxmax()} <= {"1", "2", "1+3", "2+3"}
    both = case.points[case.points["corner"] == "1+3"].iloc[0]
    assert both["pressure_1_kpa"] == case.points["pressure_1_kpa"].max()
    assert both["pressure_2_kpa"] == case.points["pressure_2_kpa"].min()


def test_the_region_of_actuators_that_only_add_is_the_sum_of_their_curves(block):
    """At a place the loads of members add, so that every point is the sum of one from each member's curve."""
    (case,) = load_polygon(block).cases()
    shape = (13, 13, 13, 2)
    both = case.points[["force_n", "moment_nmm"]].to_numpy().reshape(shape)
    rest = both[0, 0, 0]
    parts = (both[:, 0, 0] - rest)[:, None, None] + (both[0, :, 0] - rest)[:, None] + both[0, 0, :]
    np.testing.assert_allclose(both, parts, atol=1e-9 * np.abs(both).max())


def test_two_equal_members_do_twice_what_one_does(tmp_path):
    """On the diagonal, where both have one pressure."""
    design = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 4.77, "outer_radius_mm": 6.4}
    members = pd.DataFrame([{"member": n, **design} for n in (1, 2)])
    members.to_csv(tmp_path / "members.csv", index=False)
    rows = [(e, t, p) for e in (-2.0, 0.0, 2.0) for t in (-30.0, 30.0) for p in range(0, 61, 20)]
    table = pd.DataFrame(rows, columns=["elongation_mm", "twist_deg", "pressure_kpa"])
    table = table.assign(sample=1, step=np.arange(len(table)) % 4, buckled=0)
    pair = table.drop(columns="pressure_kpa").assign(
        pressure_1_kpa=table["pressure_kpa"], pressure_2_kpa=60 - table["pressure_kpa"]
    )
    found = []
    for name, rows, states, count in (
        ("one", table.assign(**design), States.from_table(table.assign(**design)), 0),
        ("two", pair, States.from_table(with_members(pair, members)), 2),
    ):
        with torch.no_grad():
            shown = build_model("continuum", {"C1": 8e5, "C2": 2e7}, [], None, count)(states).loads.numpy()
        rows.assign(force_n=shown[:, 0], moment_nmm=1e3 * shown[:, 1]).to_csv(tmp_path / f"{name}.csv", index=False)
        more = [f"data.members={tmp_path / 'members.csv'}"] if count else []
        run(tmp_path / name, "train=all", "data=csv", f"data.path={tmp_path / name}.csv", *more, "figures=false")
        fitted = freelearn.load(tmp_path / name)
        fitted.model.set_values({"C1": 8e5, "C2": 2e7})
        found.append(load_polygon(fitted, 1.0, 10.0).points)
    one, two = found
    both = two[two["pressure_1_kpa"] == two["pressure_2_kpa"]]
    assert len(both) == 25
    for name in ("force_n", "moment_nmm"):
        once = np.interp(both["pressure_1_kpa"], one["pressure_kpa"], one[name])
        # Between the points of the curve it is bent a little.
        np.testing.assert_allclose(both[name], 2 * once, atol=1e-3 * np.abs(both[name]).max())
    ends = both.iloc[[0, -1]][["force_n", "moment_nmm"]].to_numpy()
    np.testing.assert_allclose(ends, 2 * one.iloc[[0, -1]][["force_n", "moment_nmm"]].to_numpy(), rtol=1e-9)


@pytest.mark.parametrize(("force", "moment"), [(0.0, 0.0), (-2.0, 15.0)])
@pytest.mark.parametrize("which", ["alone", "block", "hung"])
def test_an_end_rests_where_the_actuators_carry_what_hangs_on_it(which, force, moment, request):
    fitted = request.getfixturevalue(which)
    found = reachable_poses(fitted, force, moment)
    kept = found.points[found.points["status"] == "ok"]
    assert len(kept) + found.lost == len(found.points)
    assert len(kept) > 0.9 * len(found.points)
    residual = loads(fitted, kept) - (force, moment)
    assert np.abs(residual[:, 0]).max() < 1e-5
    assert np.abs(residual[:, 1]).max() < 1e-4


def test_a_pose_that_rests_is_stable(alone):
    """The stiffness there is positive, by differences of the loads."""
    points = reachable_poses(alone).points.iloc[::9]
    steps = {"elongation_mm": 1e-3, "twist_deg": 1e-2}
    rates = [
        (loads(alone, points.assign(**{n: points[n] + h})) - loads(alone, points.assign(**{n: points[n] - h})))
        / (2 * h)
        for n, h in steps.items()
    ]
    (axial, back), (coupling, torsional) = (-rate.T for rate in rates)
    assert (axial > 0).all()
    assert (axial * torsional > back * coupling).all()


def test_rows_without_a_stable_equilibrium_are_blank_and_counted(alone):
    """Pulled at by more than it bears, the actuator gives way."""
    found = reachable_poses(alone, force_n=-5e3)
    lost = found.points["status"] != "ok"
    assert found.lost == lost.sum() > 0
    assert found.points.loc[lost, ["elongation_mm", "twist_deg"]].isna().all(axis=None)
    assert found.points.loc[~lost, ["elongation_mm", "twist_deg"]].notna().all(axis=None)
    assert sum(case.lost for case in found.cases()) == found.lost
    assert f"{found.lost} of {len(found.points)} points are left out" in found.notes[-1]


@pytest.mark.parametrize("which", ["alone", "block", "hung"])
def test_stiffness_is_what_differences_of_the_loads_say(which, request):
    fitted = request.getfixturevalue(which)
    found = stiffness_map(fitted)
    rows = found.table.iloc[::97]
    # The chain's own loads where the map has its place, plus and minus a step.
    for name, step, (force, moment) in (
        ("elongation_mm", 1e-3, (AXIAL, BACK)),
        ("twist_deg", 1e-2, (COUPLING, TORSIONAL)),
    ):
        up, down = (loads(fitted, rows.assign(**{name: rows[name] + h})) for h in (step, -step))
        slope = -(up - down) / (2 * step)
        for i, rate in enumerate((force, moment)):
            size = np.abs(rows[rate.column]).max()
            np.testing.assert_allclose(rows[rate.column], slope[:, i], atol=1e-5 * size)


@pytest.mark.parametrize("which", ["alone", "block", "hung"])
def test_a_conservative_model_couples_the_same_both_ways(which, request):
    found = stiffness_map(request.getfixturevalue(which))
    # N/° and N·mm/mm: one is the other, in radians.
    forth, back = np.rad2deg(found.table[COUPLING.column]), found.table[BACK.column]
    np.testing.assert_allclose(forth, back, atol=1e-7 * back.abs().max())
    assert found.symmetric
    assert found.rates == (AXIAL, TORSIONAL, COUPLING)


def test_a_sensor_that_mixes_the_loads_couples_one_way(alone):
    mixed = build_model(
        "continuum", {"C1": 8e5, "C2": 2e7, "sensor_crosstalk.force_into_moment": 1e-3}, ["sensor_crosstalk"]
    )
    found = stiffness_map(replace(alone, model=mixed))
    assert not found.symmetric
    assert found.rates == (AXIAL, TORSIONAL, COUPLING, BACK)
    assert "sensor_crosstalk" in found.notes[0]


def test_stable_means_that_the_stiffness_is_positive(alone):
    rows = stiffness_map(alone).table
    in_si = np.stack([rows[AXIAL.column] * 1e3, rows[COUPLING.column] * 180 / np.pi])
    back, torsional = rows[BACK.column], rows[TORSIONAL.column] * 1e-3 * 180 / np.pi
    matrices = np.moveaxis(np.array([in_si, [back, torsional]]), 2, 0)
    positive = (np.linalg.eigvals(matrices).real > 0).all(axis=1)
    np.testing.assert_array_equal(rows["stable"] == 1, positive)
    np.testing.assert_array_equal(rows["least_nm_per_rad"] > 0, positive)


def test_a_map_is_over_what_the_bed_moved(alone, muscle, hung):
    assert stiffness_map(alone).over == (ELONGATION, TWIST)
    assert stiffness_map(alone).ats == ["lowest", "middle", "highest"]
    given = stiffness_map(alone, 20.0, samples=[6])
    assert given.table["pressure_kpa"].unique().tolist() == [20.0]
    assert [panel.name for panel in given.panels()] == ["P = 20 kPa"]
    # A muscle that nobody turned: over its elongation and pressure.
    found = stiffness_map(muscle)
    assert found.over == (ELONGATION, PRESSURE)
    assert found.table["twist_deg"].unique().tolist() == [0.0]
    reach = muscle.table()["elongation_mm"]
    assert (found.table["elongation_mm"].min(), found.table["elongation_mm"].max()) == (reach.min(), reach.max())
    assert stiffness_map(hung).over == (ELONGATION, TWIST)


def test_a_braid_that_is_not_turned_has_no_moment_and_no_coupling(muscle):
    found = maps(muscle)
    assert found.loads.silent == (MOMENT,)
    assert found.poses.silent == (TWIST,)
    assert found.stiffness.uncoupled
    assert found.stiffness.rates == (AXIAL, TORSIONAL)
    assert any("knew no moment" in note for note in found.loads.notes)
    # Along the only way that the bed moved.
    assert found.loads.points["elongation_mm"].nunique() == 5


def test_one_sample_is_mapped_at_the_ends_of_its_plane_and_several_at_rest(alone, block):
    places = {(case.first, case.second) for case in maps(alone).loads.cases()}
    assert places == {(0.0, 0.0)}
    ends = block.table()[["elongation_mm", "twist_deg"]].agg(["min", "max"])
    places = {(case.first, case.second) for case in maps(block).loads.cases()}
    assert places == {(0, 0), *((e, 0) for e in ends["elongation_mm"]), *((0, t) for t in ends["twist_deg"])}


def test_what_was_mapped_before_changes_nothing(alone):
    """States have no past but the run's: stress softening depends on the worst of that, not on the map's order."""
    values = {"C1": 8e5, "C2": 2e7, "friction_hysteresis.force": 2.0}
    values |= {"stress_softening.depth": 0.3, "stress_softening.severity": 1e-3}
    soft = replace(alone, model=build_model("continuum", values, ["stress_softening", "friction_hysteresis"]))
    there = load_polygon(soft, 0.0, 10.0).points
    after = load_polygon(soft, (4.0, 0.0), (100.0, 10.0)).points
    after = after[after["elongation_mm"] == 0.0].reset_index(drop=True)
    pd.testing.assert_frame_equal(there, after)
    virgin = replace(alone, model=build_model("continuum", {"C1": 8e5, "C2": 2e7}))
    plain = load_polygon(virgin, 0.0, 10.0).points
    # Far from the worst that it went through, the wall is soft; nothing rubs where nothing moves.
    wall = there["moment_nmm"].iloc[0] / plain["moment_nmm"].iloc[0]
    assert wall == pytest.approx(0.7, abs=1e-3)


def test_a_network_is_mapped_for_what_it_was_fitted_to(alone, hung):
    network = build_model("mlp", {}, [])
    found = maps(replace(hung, model=network, bed=DEAD_LOAD))
    assert (found.loads, found.stiffness) == (None, None)
    with pytest.raises(UserError, match="network"):
        load_polygon(replace(hung, model=network, bed=DEAD_LOAD))
    with pytest.raises(UserError, match="isometric"):
        maps(replace(alone, model=network, bed=ISOMETRIC))
    assert maps(replace(alone, model=network)).stiffness is not None


def test_mistakes_are_said(alone, block):
    with pytest.raises(UserError, match="no sample 9"):
        load_polygon(alone, samples=[3, 9])
    with pytest.raises(UserError, match="2 pressures for 3"):
        stiffness_map(block, (10.0, 20.0))
    many = tuple(pressure_of(n) for n in range(1, 14))
    with pytest.raises(UserError, match="13 actuators"):
        PressureGrid.between(many, np.zeros(13), np.ones(13))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, 12])
def test_a_grid_has_every_combination_of_pressures(count):
    low, high = np.arange(count) * 1.0, 10.0 + np.arange(count)
    grid = PressureGrid.between(tuple(pressure_of(n + 1) for n in range(count)), low, high)
    assert len(grid.points) == len(np.unique(grid.points, axis=0)) <= 4096
    np.testing.assert_allclose([grid.points.min(0), grid.points.max(0)], [low, high])
    corners = grid.points[grid.highest >= 0]
    assert len(corners) == 2**count
    for number, point in zip(grid.highest[grid.highest >= 0], corners, strict=True):
        np.testing.assert_allclose(point, [high[m] if number >> m & 1 else low[m] for m in range(count)])
    for cell in grid.cells[:: max(1, len(grid.cells) // 50)]:
        # Round a square: each step changes one pressure by one level, and the last comes back.
        around = grid.points[[*cell, cell[0]]]
        assert (np.count_nonzero(np.diff(around, axis=0), axis=1) == 1).all()


def test_the_hull_is_that_of_a_reference():
    from scipy.spatial import ConvexHull

    generator = np.random.default_rng(0)
    for _ in range(20):
        points = generator.normal(size=(60, 2)) * (1.0, 1e4)
        found = hull(points)
        assert set(found) == set(ConvexHull(points * (1.0, 1e-4)).vertices)
        assert points[found[0], 0] == points[:, 0].min()
    assert hull(np.zeros((4, 2))).tolist() == [0]


def test_the_columns_of_a_map_name_their_units(block):
    found = maps(block)
    for table in (found.loads.points, found.poses.points, found.stiffness.table):
        unitless = {"sample", "status", "corner", "vertex", "at", "stable"}
        ends = ("_n", "_nmm", "_mm", "_deg", "_kpa", "_per_mm", "_per_deg", "_per_rad")
        assert all(str(name).endswith(ends) for name in set(table) - unitless)
    assert FORCE.column in found.loads.points
