"""What a row remembers of the rows before it."""

import math

import numpy as np
import torch

from freelearn.bed.virtual import protocol
from freelearn.measurements.states import States, severity
from freelearn.testing.tables import visits


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
    for name in ("clock", "past_severity", "dwell"):
        torch.testing.assert_close(getattr(mixed, name), getattr(plain, name)[torch.as_tensor(order)])


def test_severity_is_the_first_invariant_of_the_stretched_and_twisted_outer_surface():
    table = visits(count=5).assign(pressure_kpa=0.0)
    length, outer = table["length_mm"], table["outer_radius_mm"]
    stretch, rate = 1 + table["elongation_mm"] / length, np.deg2rad(table["twist_deg"]) / length
    found = severity(table)
    for i in range(len(table)):
        radius = outer[i] / math.sqrt(stretch[i])
        gradient = np.diag([radius / outer[i], radius / outer[i], stretch[i]])
        gradient[1, 2] = radius * rate[i]
        assert np.linalg.det(gradient) == 1 or abs(np.linalg.det(gradient) - 1) < 1e-12
        assert abs(np.trace(gradient @ gradient.T) - 3 - found[i]) < 1e-12


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
