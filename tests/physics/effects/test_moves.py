"""What depends on how the bed moves: actuators that lean beside the axis, and walls that lag behind."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.testing.contract_checks import reciprocal
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

DISTANCE2 = 9e-4
SHARE, TIME = 0.3, 100.0
LAG = {"viscoelasticity.share": SHARE, "viscoelasticity.time": TIME}


def model_of(family: str, effects=(), values=None):
    return build_model(family, TRUTH[family] | (values or {}), list(effects))


def loads(model, states) -> torch.Tensor:
    with torch.no_grad():
        return model(states).loads


def leaning(family: str, **more):
    return model_of(family, ["off_axis", *more], {"off_axis.squared_distance": DISTANCE2, **_flat(more)})


def _flat(more) -> dict[str, float]:
    return {f"{effect}.{p}": v for effect, own in more.items() for p, v in own.items()}


# --- off_axis -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("family", ["continuum", "linear"])
@pytest.mark.parametrize("more", [{}, {"twist_offset": {"angle": 0.2}, "length_offset": {"length": 1e-3}}])
def test_a_leaning_actuator_under_a_turned_block_stays_reciprocal(family, more):
    """∂F/∂φ = ∂M/∂l, and the lever is most of it: without it the two differ."""
    states = States.from_table(visits())
    assert float(states.twist.abs().min()) > 0.2
    model = leaning(family, **more)
    reciprocal(model, states)
    model.effects[-1].hand_on = lambda loads, states, p: loads
    with pytest.raises(AssertionError):
        reciprocal(model, states)


def block_length(length, twist):
    """Of an actuator DISTANCE2 beside the axis: the third side of two right triangles."""
    chord = 2 * np.sqrt(DISTANCE2) * np.sin(twist / 2)
    return np.sqrt(length**2 + chord**2)


def test_its_loads_are_the_slopes_of_the_potential_that_a_stiffness_matrix_has():
    """Π = ½ ka (l − L)² + kc (l − L) φ + ½ kb φ² − P V(l, φ), l the actuator's own length; complex steps along (l, φ)
    of the block. The linear model has this very potential."""
    states, values = States.from_table(visits()), TRUTH["linear"]
    gamma, rest, outer = (getattr(states, n).numpy() for n in ("fiber_angle", "reference_length", "outer_radius"))
    thread, wound = rest / np.cos(gamma), rest / outer * np.tan(gamma)

    def potential(length, twist):
        own = block_length(length, twist)
        volume = np.pi * (own * thread**2 - own**3) / (wound + twist) ** 2
        stored = values["ka"] / 2 * (own - rest) ** 2 + values["kb"] / 2 * twist**2
        return stored + values["kc"] * (own - rest) * twist - states.pressure.numpy() * volume

    length, twist = states.length.numpy(), states.twist.numpy()
    expected = -np.stack(
        [potential(length + 1e-30j, twist + 0j).imag / 1e-30, potential(length + 0j, twist + 1e-30j).imag / 1e-30], 1
    )
    np.testing.assert_allclose(loads(leaning("linear"), states).numpy(), expected, rtol=1e-10, atol=1e-10)


def test_its_loads_are_the_slopes_of_the_work_that_a_continuum_gives():
    """The potential as minus the work of the bare actuator's loads on the straight way to where it leans; differences
    of it along (l, φ) of the block."""
    states, bare = States.from_table(visits())[slice(0, None, 3)], model_of("continuum")
    nodes, weights = np.polynomial.legendre.leggauss(12)
    rest, length, twist = states.reference_length, states.length.numpy(), states.twist.numpy()

    def work(at_length, at_twist):
        own, total = torch.as_tensor(block_length(at_length, at_twist)), torch.zeros(len(states)).double()
        turned = torch.as_tensor(at_twist)
        for part, weight in zip((1 + nodes) / 2, weights / 2, strict=True):
            on_the_way = states.replace(length=rest + part * (own - rest), twist=part * turned)
            force, moment = loads(bare, on_the_way).unbind(-1)
            total = total + weight * (force * (own - rest) + moment * turned)
        return total.numpy()

    step = 1e-6, 1e-5
    force = (work(length + step[0], twist) - work(length - step[0], twist)) / (2 * step[0])
    moment = (work(length, twist + step[1]) - work(length, twist - step[1])) / (2 * step[1])
    found = loads(leaning("continuum"), states).numpy()
    np.testing.assert_allclose(found, np.stack([force, moment], 1), rtol=1e-5, atol=1e-5)


def test_a_force_works_through_the_lever_that_a_plan_of_the_block_shows():
    """Of a mere pull S between two pivots: its moment about the axis is S times the arm of the horizontal pull."""
    effect = EFFECTS["off_axis"]()
    p = effect.own({"off_axis.squared_distance": torch.tensor(DISTANCE2, dtype=torch.float64)})
    states = States.from_table(visits())
    pull = torch.stack([torch.full((len(states),), -7.0).double(), torch.zeros(len(states)).double()], -1)
    found = effect.hand_on(pull, states, p).numpy()
    d, twist = np.sqrt(DISTANCE2), states.twist.numpy()
    head = np.stack([d * np.cos(twist), d * np.sin(twist), states.length.numpy()], 1)
    foot = np.stack([np.full(len(twist), d), 0 * twist, 0 * twist], 1)
    direction = (foot - head) / np.linalg.norm(foot - head, axis=1, keepdims=True)
    felt = 7.0 * direction
    np.testing.assert_allclose(found[:, 0], felt[:, 2], rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], np.cross(head, felt)[:, 2], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("family", ["continuum", "linear"])
def test_on_the_axis_and_under_a_block_that_is_not_turned_nothing_changes(family):
    table, bare = visits(), model_of(family)
    states, still = States.from_table(table), States.from_table(table.assign(twist_deg=0.0))
    on_the_axis = model_of(family, ["off_axis"], {"off_axis.squared_distance": 0.0})
    assert torch.equal(loads(on_the_axis, states), loads(bare, states))
    assert torch.equal(loads(leaning(family), still), loads(bare, still))
    assert not torch.equal(loads(leaning(family), states), loads(bare, states))


# --- viscoelasticity ------------------------------------------------------------------------------------------


def path(elongations, twists=None, pressure=0.0, rows=4) -> pd.DataFrame:
    """One sample that the bed takes to these places in turn, with some rows, half a minute apart, at each."""
    table = visits(count=len(elongations), samples=(3,))
    places = np.repeat(np.array(elongations, dtype=float), 4)
    turns = np.repeat(np.zeros(len(elongations)) if twists is None else np.array(twists, dtype=float), 4)
    table = table.assign(elongation_mm=places, twist_deg=turns, pressure_kpa=pressure)
    return table[table["step"] < rows].reset_index(drop=True)


def added(table: pd.DataFrame, family: str = "continuum", values=None) -> np.ndarray:
    """What viscoelasticity adds to the loads, (N, 2)."""
    states = States.from_table(table)
    lagging = model_of(family, ["viscoelasticity"], LAG | (values or {}))
    return (loads(lagging, states) - loads(model_of(family), states)).numpy()


@pytest.mark.parametrize("family", ["continuum", "linear"])
def test_a_bed_that_does_not_move_knows_no_lag(family):
    assert (added(path([2.0] * 4, [40.0] * 4, 30.0), family) == 0).all()


def test_stretched_it_pulls_more_and_come_back_it_pushes():
    force = added(path([0.0, 4.0, 0.0, -3.0]))[:, 0].reshape(4, 4)
    assert (force[0] == 0).all()
    assert (force[1] < -0.01).all()
    assert (force[2] > 0.01).all()
    assert (force[3] > 0.01).all()
    moment = added(path([0.0] * 3, [0.0, 60.0, 0.0]))[:, 1].reshape(3, 4)
    assert (moment[1] < 0).all()
    assert (moment[2] > 0).all()


def test_what_lags_behind_decays_with_the_dwell():
    """A stiffness matrix is linear: K (Δl, Δφ) g e^(−t/τ), t = 0, 30, 60, 90 s. No pressure, so no volume."""
    values, found = TRUTH["linear"], added(path([1.0, 4.0, -2.0], [10.0, -50.0, 30.0]), "linear").reshape(3, 4, 2)
    for move, change in (((3e-3, -60.0), found[1]), ((-6e-3, 80.0), found[2])):
        length, twist = move[0], np.deg2rad(move[1])
        stiff = [values["ka"] * length + values["kc"] * twist, values["kc"] * length + values["kb"] * twist]
        expected = -SHARE * np.exp(-np.arange(4)[:, None] * 30.0 / TIME) * np.array(stiff)
        np.testing.assert_allclose(change, expected, rtol=1e-10)


def test_the_first_state_of_each_sample_has_rested():
    table = visits(count=3)
    first = (table.groupby("sample").cumcount() < 4).to_numpy()
    change = added(table)
    assert (change[first] == 0).all()
    assert (np.abs(change[~first]).max(1) > 0).all()


@pytest.mark.parametrize("column", ["buckled", "left_out"])
def test_rows_that_do_not_count_are_remembered_all_the_same(column):
    """A state that buckled, or was left out, was a place that the bed came from."""
    table = path([0.0, 4.0, -3.0, 1.0], [0.0, 50.0, -20.0, 60.0], 20.0).assign(force_n=0.0, moment_nmm=0.0, buckled=0)
    marked = table.assign(**{column: np.repeat([0, 1, 0, 0], 4)})
    whole, counted = Rows.from_table(table), Rows.from_table(marked)
    kept = torch.as_tensor(np.flatnonzero(marked[column] == 0))
    model = model_of("continuum", ["viscoelasticity"], LAG)
    assert torch.equal(loads(model, counted[kept].states), loads(model, whole.states)[kept])
    # Cut out of the table, it would be another history.
    cut = States.from_table(marked[marked[column] == 0].reset_index(drop=True))
    assert not torch.allclose(loads(model, cut), loads(model, whole.states)[kept], rtol=1e-4)
