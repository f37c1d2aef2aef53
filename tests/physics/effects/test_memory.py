"""What a row remembers of the rows before it."""

import math

import numpy as np
import pandas as pd
import pytest
import torch
from scipy.optimize import minimize_scalar

from freelearn.data.states import States, severity
from freelearn.physics.simulated_bed import protocol
from freelearn.testing.small_tables import visits


def test_clock_and_hold_follow_the_column_of_times():
    table = visits(count=2)
    table["time_s"] += 1e6
    states = States.from_table(table)
    np.testing.assert_allclose(states.dwell.reshape(-1, 4), [[0, 30, 60, 90]] * 4)
    np.testing.assert_allclose(states.clock[:8], [0, 30, 60, 90, 3600, 3630, 3660, 3690])
    assert states.clock[8] == 0  # the next sample


def test_without_times_a_row_takes_the_papers_twenty_seconds():
    states = States.from_table(visits(count=2).drop(columns="time_s"))
    np.testing.assert_allclose(states.dwell.reshape(-1, 4), [[0, 20, 40, 60]] * 4)
    np.testing.assert_allclose(states.clock.reshape(2, 8), [np.arange(8) * 20.0] * 2)


def test_samples_may_be_mixed_in_the_file():
    table = visits(count=2).drop(columns="time_s")
    order = np.arange(16).reshape(2, 2, 4).transpose(1, 0, 2).reshape(-1)
    mixed, plain = States.from_table(table.iloc[order]), States.from_table(table)
    for name in ("clock", "past_severity", "dwell", "moved_length", "moved_twist"):
        torch.testing.assert_close(getattr(mixed, name), getattr(plain, name)[torch.as_tensor(order)])


def moved(table):
    """Elongation [mm] and twist [deg] by which the bed had moved to each row's state."""
    states = States.from_table(table)
    return np.stack([states.moved_length.numpy() * 1e3, np.rad2deg(states.moved_twist.numpy())], axis=1)


def test_a_move_is_that_from_the_samples_last_state_to_this_one():
    """Of all rows of a state alike, none to a sample's first, and there and back again to a place visited twice."""
    table = visits(count=3)
    place = table[["elongation_mm", "twist_deg"]].to_numpy()[::4]
    expected = np.zeros((6, 2))
    for state in (1, 2, 4, 5):
        expected[state] = place[state] - place[state - 1]
    np.testing.assert_allclose(moved(table), expected.repeat(4, axis=0), atol=1e-12)
    again = pd.concat([table[:8], table[:4]], ignore_index=True)
    np.testing.assert_allclose(moved(again)[8], -moved(again)[4], atol=1e-12)
    assert (moved(pd.concat([table[:4]] * 2, ignore_index=True)) == 0).all()


def test_a_bed_that_creeps_while_the_pressure_changes_moves_from_where_it_ended():
    """To the state's first row from the last one of the state before; what creeps within a state is no move."""
    table = visits(count=2, samples=(3,))
    table["elongation_mm"] += 0.01 * table["step"]
    elongation = table["elongation_mm"].to_numpy()
    np.testing.assert_allclose(moved(table)[4:, 0], elongation[4] - elongation[3], atol=1e-12)
    assert (moved(table)[:4] == 0).all()


def test_buckled_and_left_out_rows_are_places_that_the_bed_came_from():
    table = visits(count=4)
    marked = table.assign(buckled=np.arange(len(table)) // 4 % 2, left_out=np.arange(len(table)) // 4 % 3 == 1)
    np.testing.assert_array_equal(moved(marked), moved(table))


def test_where_loads_are_imposed_the_bed_moves_nothing():
    hung = np.random.default_rng(0).uniform(-1, 1, 8).repeat(4)
    table = visits(count=4).assign(bed="dead_load", force_n=hung, moment_nmm=hung)
    assert (moved(table.drop(columns=["elongation_mm", "twist_deg"])) == 0).all()


def test_severity_is_the_energy_of_a_thin_tube_that_balances_the_pressure():
    """Of a tube of the mean radius, from its deformation gradient; the hoop stretch by SciPy's scalar minimization."""
    table = visits(count=5)
    inner, outer = table["inner_radius_mm"], table["outer_radius_mm"]
    found = severity(table)
    for i in range(len(table)):
        radius, wall, angle = (inner[i] + outer[i]) / 2, outer[i] - inner[i], np.deg2rad(table["gamma_deg"][i])
        axial = 1 + table["elongation_mm"][i] / table["length_mm"][i]
        rate = np.deg2rad(table["twist_deg"][i]) / table["length_mm"][i]
        fiber = np.array([0, math.sin(angle), math.cos(angle)])

        def energy(hoop, radius=radius, axial=axial, rate=rate, fiber=fiber):
            gradient = np.diag([1 / (hoop * axial), hoop, axial])
            gradient[1, 2] = hoop * radius * rate
            assert abs(np.linalg.det(gradient) - 1) < 1e-12
            stretched = gradient @ fiber
            return np.trace(gradient @ gradient.T) - 3 + 30 * (stretched @ stretched - 1) ** 2

        # The fluid's work on a ring of the wall, over half the shear modulus of 1 MPa: P π r² l / (2 π R t L µ/2).
        push = table["pressure_kpa"][i] * 1e3 * radius * axial / wall / 1e6
        best = minimize_scalar(lambda hoop, push=push: energy(hoop) - push * hoop**2, bounds=(0.5, 2), method="bounded",
                               options={"xatol": 1e-10})  # fmt: skip
        # The minimizer finds the place to about the root of the rounding error.
        assert found[i] == pytest.approx(energy(best.x), abs=1e-6)


def test_pressure_adds_to_the_severity_and_nothing_takes_off():
    table = visits(count=5)
    assert (severity(table) >= severity(table.assign(pressure_kpa=0.0))).all()
    rest = table.assign(pressure_kpa=0.0, elongation_mm=0.0, twist_deg=0.0)
    np.testing.assert_allclose(severity(rest), 0, atol=1e-15)


def test_the_past_is_the_worst_so_far_buckled_rows_included():
    table = visits(count=3).assign(buckled=0)
    table.loc[0, ["elongation_mm", "twist_deg", "buckled"]] = -20.0, 300.0, 1
    states = States.from_table(table)
    worst = states.severity[0]
    assert torch.equal(states.past_severity[:12], worst.expand(12))
    other = states[slice(12, 24)]
    expected = [max(other.severity[: i + 1].tolist()) for i in range(12)]
    assert other.past_severity.tolist() == expected


def test_the_whole_protocol_is_remembered_quickly_and_sensibly():
    states = States.from_table(protocol())
    assert (states.past_severity >= states.severity).all()
    assert float(states.dwell.max()) == 180
    assert float(states.clock.max()) == 2859 * 20
