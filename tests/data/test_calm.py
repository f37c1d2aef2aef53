"""What a gauge flickers, against ramps and holds that are known without it."""

import numpy as np
import pandas as pd
import pytest
import torch
from test_corners import table

from freelearn.data.rows import Rows
from freelearn.fitting.problem import Problem
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import C1, C2, measured

NOISE = 0.15
EVERY = 0.2


def triangle(time):
    return np.interp(time, [0.0, 2.0, 6.0, 9.0, 13.0, 15.0, 20.0], [5.0, 5.0, 45.0, 45.0, 12.0, 12.0, 60.0])


def recording(pressure, time=None, run=None):
    time = np.arange(len(pressure)) * EVERY if time is None else time
    return Rows.from_table(table(time, pressure, 1 if run is None else run)).states.recording


def pressures(recording):
    """Of the table's own rows, as measured and calmed [kPa]."""
    own = torch.ones(len(recording), dtype=torch.bool) if recording.turns is None else ~recording.turns
    measured = recording.states.pressure
    return (each[own].numpy() / 1e3 for each in (measured, recording.calmed(measured[:, None])[:, 0]))


def test_on_ramps_and_holds_most_of_the_noise_is_gone_and_turns_stay_sharp():
    time = np.arange(0, 20, EVERY)
    truth = triangle(time)
    before, after = [], []
    for seed in range(20):
        measured, calmed = pressures(recording(truth + NOISE * np.random.default_rng(seed).normal(size=len(time))))
        before.append(measured - truth)
        after.append(calmed - truth)
    before, after = np.array(before), np.array(after)
    assert np.sqrt((after**2).mean()) < 0.55 * np.sqrt((before**2).mean())
    # On average no row is off by as much as the noise, not even where the pressure turns.
    assert np.abs(after.mean(0)).max() < NOISE
    # The largest reading before a turn is not the one that the noise has raised.
    assert np.mean([(each + truth)[:45].max() for each in after]) < 45 + 0.7 * NOISE
    assert np.mean([(each + truth)[:45].max() for each in before]) > 45 + 1.3 * NOISE


@pytest.mark.parametrize("shape", ["sine", "steps", "walk"])
def test_what_goes_along_no_lines_stays_as_it_is(shape):
    time = np.arange(0, 40, EVERY)
    steps = np.random.default_rng(1).normal(size=len(time))
    truth = {
        "sine": 30 + 20 * np.sin(2 * np.pi * time / 8), "steps": 10.0 + 20 * (np.floor(time / 5) % 2),
        "walk": 100 + np.cumsum(steps),
    }[shape]  # fmt: skip
    _, calmed = pressures(recording(truth))
    # A walk's steps cannot be told from noise where three of them happen to lie on a line.
    assert np.abs(calmed - truth).max() < (2.0 if shape == "walk" else 1e-3)


def test_no_line_goes_on_into_another_recording_or_across_a_gap():
    time = np.concatenate([np.arange(0, 4, EVERY), np.arange(0, 4, EVERY)])
    run = np.repeat([1, 2], len(time) // 2)
    pressure = np.where(run == 1, 40.0, 10.0) + 1e-3 * np.random.default_rng(3).normal(size=len(time))
    _, calmed = pressures(recording(pressure, time, run))
    assert np.abs(calmed - np.where(run == 1, 40.0, 10.0)).max() < 3e-3
    # A line is one in time, whatever the steps.
    uneven = np.cumsum(np.random.default_rng(4).uniform(0.05, 2.0, 200))
    truth = 10 + 0.5 * uneven
    _, calmed = pressures(recording(truth + 0.05 * np.random.default_rng(5).normal(size=200), uneven))
    assert np.sqrt(((calmed - truth) ** 2).mean()) < 0.6 * 0.05


def test_steps_of_a_gauges_last_digit_are_smoothed_as_its_noise():
    """Most rows are like the one before, and no noise seems to be in them."""
    time = np.arange(0.0, 60.0, 0.1)
    truth = np.interp(time, [0, 3, 33, 40, 60], [4.0, 4.0, 22.0, 22.0, 10.0])
    shown, calmed = pressures(recording((truth / 0.4).round() * 0.4, time))
    assert np.sqrt(((calmed - truth) ** 2).mean()) < 0.3 * np.sqrt(((shown - truth) ** 2).mean())


def test_some_recordings_are_as_they_are_among_all():
    time = np.tile(np.arange(0, 8, EVERY), 3)
    run = np.repeat([1, 2, 3], len(time) // 3)
    pressure = 5 * time + NOISE * np.random.default_rng(0).normal(size=len(time))
    whole = recording(pressure, time, run)
    signal = whole.states.pressure[:, None]
    rows = (whole.run != 1).nonzero()[:, 0]
    assert torch.equal(whole[rows].calmed(signal[rows]), whole.calmed(signal)[rows])
    # Of a part of a recording those are calm whose line is in it.
    some = torch.arange(30)
    calmed, changed = whole[some].calmed(signal[some]), whole.calmed(signal)[some]
    same = (calmed == changed)[:, 0]
    assert bool(same[:26].all())
    assert torch.equal(calmed[~same], signal[some][~same])


def test_what_is_asked_of_a_model_is_taken_as_it_is():
    time = np.arange(0, 20, EVERY)
    asked = Rows.straight(table(time, triangle(time))).states.recording
    signal = asked.states.pressure[:, None]
    assert asked.calmed(signal) is signal


SMOOTHING = {
    "threads as weak as the noise": {
        "maxwell_slip": {"share": 0.7, "force": 0.01, "moment": 1e-3, "asymmetry": 0.0},
    },
    "a lag that readings are ahead of by as much": {"supply_lag": {"time": 0.07}, "dead_time": {"delay": -0.07}},
    "a cell that is late by as much as the gauge": {"dead_time": {"delay": -0.1}, "sensor_lag": {"force": 0.1}},
}


@pytest.mark.parametrize("sample", [3, 4])
@pytest.mark.parametrize("smoothing", SMOOTHING)
def test_no_effect_takes_a_gauges_noise_off(smoothing, sample):
    """Where nothing is hidden, what follows a gauge's readings late or in steps, on average at once, would else fit
    better than nothing: it is a mean of several readings."""
    time = np.arange(0, 60, 0.1)
    up_and_down = np.interp(time, [0, 5, 25, 30, 50, 60], [5.0, 5.0, 60.0, 60.0, 10.0, 10.0])
    held = pd.DataFrame({"time_s": time, "pressure_kpa": up_and_down, "elongation_mm": 1.0, "twist_deg": 20.0})
    table = measured(held.assign(sample=sample, run=1), {}, seed=7).drop(columns="moment_nmm").assign(bed="isometric")
    values = {f"{name}.{label}": value for name, p in SMOOTHING[smoothing].items() for label, value in p.items()}
    effects = list(SMOOTHING[smoothing])

    def left(rows, values, names):
        """Sum of squares about the mean, which is off with the place."""
        model = build_model("continuum", {"C1": C1, "C2": C2, **values}, names)
        return np.var(Problem(model, rows).residual(model.vector().detach()).detach()[::2].numpy())

    calm, flickers = Rows.from_table(table), Rows.straight(table)
    nothing = left(calm, {}, [])
    assert left(flickers, values, effects) < 0.99 * nothing
    assert left(calm, values, effects) > 0.997 * nothing
