"""Corners of a pressure between the rows of a log, against the ramps that it was sampled from."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.corners import with_corners
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import C1, C2, log

DESIGN = {"sample": 4, "gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.0}


def table(time, pressure, run=1):
    steps = {"step": np.arange(len(time)), "elongation_mm": 0.01 * time, "twist_deg": 0.0, "buckled": 0}
    read = {"pressure_kpa": pressure, "force_n": 0.0, "moment_nmm": 0.0}
    return pd.DataFrame({"time_s": time, "run": run, **read}).assign(**DESIGN, **steps)


def added(rows):
    """Times [s] and pressures [kPa] of the samples that the table has not."""
    recording, place = rows.recording, rows.place
    new = torch.ones(len(recording.time), dtype=torch.bool)
    new[place] = False
    return recording.time[new].numpy(), recording.states.pressure[new].numpy() / 1e3


CORNERS = np.array([0.0, 1.13, 2.57, 4.44, 6.91, 9.0]), np.array([0.0, 0.0, 60.0, 60.0, 10.0, 10.0])


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_lines_meet_where_the_pressure_turned(noise):
    time = np.sort(np.random.default_rng(1).uniform(0.0, 9.0, 45))
    error = noise * np.random.default_rng(2).normal(size=len(time))
    rows = States.from_table(table(time, np.interp(time, *CORNERS) + error))
    found, pressure = added(with_corners(rows))
    near = np.abs(found[:, None] - CORNERS[0][1:-1]).argmin(axis=0)
    np.testing.assert_allclose(found[near], CORNERS[0][1:-1], atol=1e-9 + noise)
    np.testing.assert_allclose(pressure[near], CORNERS[1][1:-1], atol=1e-9 + 5 * noise)
    assert noise or len(found) == 4


def test_rows_stay_what_they_are_and_all_else_goes_straight():
    time = np.arange(0.0, 9.0, 0.25)
    plain = States.from_table(table(time, np.interp(time, *CORNERS)))
    rows = with_corners(plain)
    assert len(rows.recording) > len(plain.recording)
    for own, whole, before in zip(rows.inputs(), rows.recording.states.inputs(), plain.inputs(), strict=True):
        assert torch.equal(own, whole[rows.place])
        assert torch.equal(own, before)
    times, _ = added(rows)
    new = torch.isin(rows.recording.time, torch.as_tensor(times))
    length = rows.recording.states.length - rows.recording.states.reference_length
    np.testing.assert_allclose(length[new].numpy(), 1e-5 * times, atol=1e-15)


@pytest.mark.parametrize(
    "pressure",
    [
        lambda t: 30 + 30 * np.sin(2 * np.pi * t / 4),
        lambda t: np.where(t < 4, 10.0, 50.0),
        lambda t: 30 + 0 * t,
        lambda t: 8 * t,
    ],
    ids=["a wave", "a step", "rest", "a ramp"],
)
def test_no_corner_where_none_is_told(pressure):
    time = np.arange(0.0, 8.0, 0.2)
    rows = States.from_table(table(time, pressure(time)))
    assert with_corners(rows) is rows


def test_noise_makes_few():
    time = np.arange(0.0, 100.0, 0.2)
    noisy = 30 + 0.15 * np.random.default_rng(3).normal(size=len(time))
    found, _ = added(with_corners(States.from_table(table(time, noisy))))
    assert len(found) < 0.15 * len(time)


def test_no_line_goes_on_into_another_recording():
    time = np.tile(np.arange(0.0, 2.0, 0.2), 2)
    both = table(time, np.where(np.arange(len(time)) < 10, 20 * time, 50 - 15 * time), np.repeat([1, 2], 10))
    rows = States.from_table(both)
    assert with_corners(rows) is rows


@pytest.mark.parametrize("effect", [{"supply_lag": {"time": 0.02}}, {"dead_time": {"delay": 0.03}}])
def test_what_is_quicker_than_the_rows_follows_the_corners(effect):
    """Beside the bed's small steps, without noise: the error is a third of that of straight lines, or less."""
    exact = log(effect, 5, (4,), recordings=3, noise=0.0)
    model = build_model("continuum", {"C1": C1, "C2": C2}, list(effect), [4])
    model.set_values({f"{name}.{p}": value for name, values in effect.items() for p, value in values.items()})
    rows = Rows.from_table(exact)
    with torch.no_grad():
        errors = [
            (model(states).loads - rows.loads)[:, 0].square().mean().sqrt()
            for states in (rows.states, States.from_table(exact))
        ]
    assert errors[0] < errors[1] / 3


def test_what_is_asked_of_a_model_goes_straight():
    time = np.arange(0.0, 9.0, 0.25)
    read = table(time, np.interp(time, *CORNERS))
    assert len(Rows.straight(read).states.recording) == len(read)
    assert len(Rows.from_table(read).states.recording) == len(read) + 4
