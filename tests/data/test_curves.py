"""Pressures that go along curves between the rows of a log, against those that they were sampled from."""

import numpy as np
import pytest
import torch
from test_corners import CORNERS, table

from freelearn.data.corners import with_corners
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import C1, C2, MM, SAMPLES, carried

NOISE = 0.15


def sine(time, rows, every=0.2):
    """Pressure [kPa] with so many rows in a period."""
    return 30 - 30 * np.cos(2 * np.pi * time / (rows * every))


def off(states, truth):
    """How far a straight line from sample to sample is from the truth [kPa] at many times, root mean square."""
    recording = states.recording
    time = np.linspace(1.0, float(recording.time[-1]) - 1.0, 4000)
    line = np.interp(time, recording.time.numpy(), recording.states.pressure.numpy() / 1e3)
    return np.sqrt(np.mean((line - truth(time)) ** 2))


@pytest.mark.parametrize("rows", [8, 12, 20])
def test_samples_along_a_sine_lie_on_it_within_the_gauge_s_noise(rows):
    time = np.arange(0.0, 20.0, 0.2)
    read = sine(time, rows) + np.random.default_rng(rows).normal(0, NOISE, len(time))
    plain = States.from_table(table(time, read))
    assert off(with_corners(plain), lambda t: sine(t, rows)) < min(2.5 * NOISE, off(plain, lambda t: sine(t, rows)))


def test_a_sine_of_uneven_rows_is_followed_too():
    time = np.arange(0.0, 20.0, 0.2) + np.random.default_rng(1).uniform(-0.05, 0.05, 100)
    plain = States.from_table(table(time, sine(time, 10)))
    assert off(with_corners(plain), lambda t: sine(t, 10)) < off(plain, lambda t: sine(t, 10)) / 5


@pytest.mark.parametrize("seed", range(4))
def test_between_corners_nothing_is_a_curve(seed):
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, 9.0, 0.2)
    rows = with_corners(States.from_table(table(time, np.interp(time, *CORNERS) + generator.normal(0, NOISE, 45))))
    assert len(rows.recording) - len(time) <= len(CORNERS[0])


@pytest.mark.parametrize(
    ("effect", "values"),
    [("dead_time", {"delay": 0.3}), ("supply_lag", {"time": 0.4})],
)
def test_what_comes_late_of_a_sine_is_that_of_small_steps(effect, values):
    """Eight rows in a period, of which a delay of one and a half asks halfway between them."""
    every, rows, steps = 0.2, 8, 40
    fine = np.arange(60 * steps + 1) * every / steps
    pressure = sine(fine, rows)
    loads, _ = carried(4, (0.0 * fine, 0.0 * fine + 20.0), fine, pressure * 1e3, {effect: values})
    gamma, length, inner, outer = SAMPLES[4]
    design = {"gamma_deg": gamma, "length_mm": length, "inner_radius_mm": inner, "outer_radius_mm": outer}
    seen = table(fine[::steps], pressure[::steps]).assign(**design, elongation_mm=0.0, twist_deg=20.0)
    seen = seen.assign(force_n=loads[::steps, 0], moment_nmm=loads[::steps, 1] / MM)

    def missed(made):
        model = build_model("continuum", {}, [effect])
        model.prepare(made)
        model.set_values({"C1": C1, "C2": C2} | {f"{effect}.{name}": value for name, value in values.items()})
        with torch.no_grad():
            errors = (model(made.states).loads - made.loads)[8:-8, 0]
        return float(errors.square().mean().sqrt() / made.loads[:, 0].abs().max())

    along = missed(Rows.from_table(seen))
    assert along < 0.006
    assert along < missed(Rows.straight(seen)) / 3


def test_a_slow_sine_needs_nothing_between_its_rows_however_exact_they_are():
    time = np.arange(0.0, 20.0, 0.2)
    plain = States.from_table(table(time, sine(time, 100)))
    assert with_corners(plain) is plain
