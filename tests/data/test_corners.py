"""Corners of a pressure between the rows of a log, against the ramps that it was sampled from."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.corners import rounding, with_corners
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
        lambda t: np.where(t < 4, 10.0, 50.0),
        lambda t: 30 + 0 * t,
        lambda t: 8 * t,
    ],
    ids=["a step", "rest", "a ramp"],
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


def test_a_twist_turns_between_rows_too():
    time = np.arange(0.0, 9.0, 0.25)
    turned = table(time, 30.0 + 0 * time).assign(twist_deg=np.interp(time, *CORNERS))
    recording = with_corners(States.from_table(turned)).recording
    new = ~np.isin(recording.time.numpy(), time)
    np.testing.assert_allclose(recording.time[new].numpy(), CORNERS[0][1:-1], atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(recording.states.twist[new].numpy()), CORNERS[1][1:-1], atol=1e-9)


def test_of_two_that_turn_in_one_interval_the_corner_is_that_of_the_larger_turn_whatever_their_units():
    time = np.arange(0.0, 9.0, 0.25)
    both = table(time, np.interp(time, *CORNERS)).assign(
        twist_deg=np.interp(time, [0.0, 2.51, 9.0], [0.0, 0.0, 1e-3]), elongation_mm=0.0
    )
    times, _ = added(with_corners(States.from_table(both)))
    assert np.abs(times - 2.57).min() < 1e-9


def moves(generator, begins, takes, every=0.5, noise=0.02):
    """Rows of a log of recordings that each move once, from 10 to 60 kPa."""
    parts = []
    for run, (begin, taken) in enumerate(zip(begins, takes, strict=True), start=1):
        time = np.arange(0.0, 6.0, every)
        pressure = np.interp(time, [0.0, begin, begin + taken, 20.0], [10.0, 10.0, 60.0, 60.0])
        parts.append(table(time, pressure + noise * generator.normal(size=len(time)), run))
    return Rows.from_table(pd.concat(parts, ignore_index=True))


def lost(rows):
    """Rows of which nothing is left, by recording."""
    gone = ~rows.told().readings.present[:, 0].numpy()
    return [int(gone[rows.state == run].sum()) for run in np.unique(rows.state)]


def test_what_follows_a_move_of_which_too_few_rows_tell_is_left_out():
    """Within one interval; with a row in its middle, like one over two whole intervals; over more of them."""
    begins, takes = [2.1, 2.3, 2.3, 2.6, 2.2, 2.3, 1.8], [0.3, 0.4, 0.4, 1.3, 2.4, 0.4, 0.4]
    rows = moves(np.random.default_rng(2), begins, takes)
    assert lost(rows) == [1, 2, 2, 0, 0, 2, 2]
    assert rows.told().states is rows.states


def test_moves_that_begin_and_end_at_rows_are_told_however_short():
    rows = moves(np.random.default_rng(2), [2.0, 2.5, 2.0, 3.0, 2.0, 2.0], [0.5, 1.0, 1.5, 2.0, 2.5, 0.5])
    assert lost(rows) == [0] * 6


def test_a_log_is_judged_by_all_its_rows_whichever_are_looked_at():
    """A row that is not looked at is no corner between two that are."""
    tied = moves(np.random.default_rng(2), [2.0] * 8, [1.0] * 6 + [1.5] * 2)
    loose = moves(np.random.default_rng(2), [2.1, 2.3, 2.3, 2.6, 2.2], [0.3, 0.4, 0.4, 1.3, 2.4])
    for rows in (tied, loose):
        some = torch.tensor([row for row in range(len(rows)) if row % 12 not in (7, 8)])
        assert torch.equal(rows[some].told().readings.present, rows.told().readings.present[some])


def test_few_such_rows_are_borne():
    rows = moves(np.random.default_rng(2), [2.1] * 9 + [2.3], [1.2] * 9 + [0.4])
    assert rows.told() is rows


def test_a_log_that_is_all_like_that_is_taken_as_it_is():
    time = np.arange(0.0, 20.0, 0.5)
    rows = Rows.from_table(table(time, np.random.default_rng(4).uniform(0, 60, len(time))))
    assert rows.told() is rows
    still = Rows.from_table(table(time, 30 + 0 * time))
    assert still.told() is still


def test_what_is_asked_of_a_model_goes_straight():
    time = np.arange(0.0, 9.0, 0.25)
    read = table(time, np.interp(time, *CORNERS))
    assert len(Rows.straight(read).states.recording) == len(read)
    assert len(Rows.from_table(read).states.recording) == len(read) + 4


def test_steps_of_a_digit_are_noise():
    shown = (np.linspace(4.0, 40.0, 600) / 0.4).round() * 0.4
    assert rounding(shown * 1e3) == pytest.approx(400 / 12**0.5, rel=1e-6)
    # What a bed was set to is no digit, and neither are readings of many digits.
    generator = np.random.default_rng(0)
    assert rounding(np.repeat(1e3 * generator.choice(100, 12, replace=False), 50)) == 0.0
    assert rounding(shown + 0.1 * generator.normal(size=len(shown))) == 0.0
