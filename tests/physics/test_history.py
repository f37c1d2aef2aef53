"""Effects of the history against fine-step integration by SciPy, and rows against their recordings."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.lags import SPREAD, delayed, exponential, lag, rung
from freelearn.physics.effects.history.valve_flow import ATMOSPHERE, filled
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH, labels_of
from freelearn.testing.small_tables import recordings, visits

HISTORY = [name for name, effect in EFFECTS.items() if effect.port == "history"]


@pytest.fixture(scope="module")
def recording():
    return States.from_table(recordings()).recording


def integrated(time, signal, tau):
    """y of τ y' = x − y by an adaptive solver, x a straight line between samples."""
    found = solve_ivp(
        lambda t, y: (np.interp(t, time, signal) - y) / tau,
        (time[0], time[-1]), [signal[0]], t_eval=time, rtol=1e-10, atol=1e-9, max_step=0.02,
    )  # fmt: skip
    return found.y[0]


@pytest.mark.parametrize("tau", [0.05, 0.7, 20.0])
def test_a_lag_is_exact_between_samples(recording, tau):
    x = recording.states.pressure
    y = x - lag(x[:, None], recording, torch.tensor(tau, dtype=torch.float64))[:, 0]
    for run in (0, 3):
        own = recording.run == run
        expected = integrated(recording.time[own].numpy(), x[own].numpy(), tau)
        np.testing.assert_allclose(y[own], expected, rtol=1e-6)


def measured(curve, time, pressure):
    """A measured log whose pressure went straight from row to row of a ramp, and a signal that went along a curve."""
    table = recordings((3,)).iloc[np.zeros(len(time), dtype=int)].reset_index(drop=True)
    table = table.assign(time_s=time, pressure_kpa=pressure, run=1, step=range(len(time)))
    return Rows.from_table(table).states.recording, torch.as_tensor(curve(time))[:, None]


@pytest.mark.parametrize("tau", [1e-3, 0.05, 0.7, 20.0, 1e4])
def test_a_lag_of_a_curve_along_a_ramp_is_exact(tau):
    """Loads go along curves where a ramp is straight: as a straight line from row to row a lag would take a hundredth
    of it for late."""
    time = np.arange(0, 4.01, 0.2)
    recording, x = measured(lambda t: 1.3 * t**2 + 0.2 * t, time, 10 * time)
    expected = solve_ivp(
        lambda t, y: (1.3 * t**2 + 0.2 * t - y) / tau,
        (0, 4),
        [0.0],
        t_eval=time,
        rtol=1e-10,
        atol=1e-12,
        method="Radau",
    ).y[0]
    y = x - lag(x, recording, torch.tensor(tau, dtype=torch.float64))
    np.testing.assert_allclose(y[:, 0], expected, rtol=0, atol=1e-6)


def test_a_swing_of_a_curve_along_a_ramp_is_exact():
    time, period, damping = np.arange(0, 4.01, 0.2), 0.9, 0.2
    recording, x = measured(lambda t: 1.3 * t**2 + 0.2 * t, time, 10 * time)
    omega = 2 * np.pi / period
    expected = solve_ivp(
        lambda t, y: [y[1], -2 * damping * omega * y[1] - omega**2 * (y[0] - 1.3 * t**2 - 0.2 * t)],
        (0, 4), [0.0, 0.0], t_eval=time, rtol=1e-10, atol=1e-12,
    ).y[0]  # fmt: skip
    each = (torch.tensor(value, dtype=torch.float64) for value in ([period], damping))
    np.testing.assert_allclose(rung(x, recording, *each)[:, 0], expected, rtol=0, atol=1e-6)


def test_where_a_ramp_turns_a_lag_is_of_straight_lines():
    """Of three rows about a corner none tells a curve: the lag is that of a command with the same rows."""
    time = np.arange(0, 4.01, 0.2)
    corners = np.interp(time, [0, 2, 4], [0, 30, 10])
    recording, x = measured(lambda t: np.interp(t, [0, 2, 4], [0.0, 30.0, 10.0]), time, corners)
    tau = torch.tensor(0.4, dtype=torch.float64)
    plain = lag(x, replace(recording, calm=None), tau)
    np.testing.assert_allclose(lag(x, recording, tau), plain, rtol=0, atol=1e-9)


def test_a_delay_is_an_interpolation_of_each_recording(recording):
    x = recording.states.pressure
    for delay in (0.0, 0.13, 1.0, 50.0, -0.2):
        y = delayed(x[:, None], recording, torch.tensor(delay, dtype=torch.float64))[:, 0]
        for run in range(4):
            own = recording.run == run
            time = recording.time[own].numpy()
            np.testing.assert_allclose(y[own], np.interp(time - delay, time, x[own].numpy()), rtol=1e-12)


def test_creep_is_undone_to_the_error_of_straight_lines():
    """Undone and carried again, on a fine log: each takes its own signal for a straight line between samples."""
    table = recordings((3,))[:14]
    fine = table.loc[table.index.repeat(200)].reset_index(drop=True)
    fine["time_s"] = np.linspace(0, 3, len(fine))
    states = States.from_table(fine)
    p = EFFECTS["creep"]().own(
        {k: torch.tensor(v, dtype=torch.float64) for k, v in labels_of("creep", "scale").items()}
    )
    signal = torch.sin(3 * states.recording.time)[:, None]
    effect = EFFECTS["creep"]()
    back = effect.carry(effect.undo(signal, states.recording, p), states.recording, p)
    torch.testing.assert_close(back, signal, rtol=0, atol=1e-6)


def test_maxwell_slip_is_its_elements_one_by_one():
    states = States.from_table(recordings())
    values = labels_of("maxwell_slip", "scale")
    bare = build_model("linear", TRUTH["linear"])(states).loads
    with torch.no_grad():
        shown = build_model("linear", TRUTH["linear"] | values, ["maxwell_slip"])(states).loads
    force, share, skew = bare[:, 0].tolist(), values["maxwell_slip.share"], values["maxwell_slip.asymmetry"]
    expected, z = [], np.zeros(len(SPREAD.ratios))
    for n, f in enumerate(force):
        for i, ratio in enumerate(SPREAD.ratios):
            r = values["maxwell_slip.force"] * ratio
            begins = bool(states.recording.first[n])
            z[i] = 0.0 if begins else min(max(z[i] + f - force[n - 1], -r * (1 + skew)), r * (1 - skew))
        expected.append(f - share * float(z @ np.array(SPREAD.shares)))
    np.testing.assert_allclose(shown[:, 0], expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("count", [1, 5, 16, 200])
def test_elements_stand_for_an_exponential_distribution(count):
    """Their shares make one, their mean is the distribution's; the loop that they make nears the integral's."""
    ratios, shares = (np.array(each) for each in exponential(count))
    assert shares.sum() == pytest.approx(1.0)
    assert shares @ ratios == pytest.approx(1.0)
    gone = np.linspace(0, 12, 500)
    made = np.minimum(gone, ratios[:, None]).T @ shares
    assert np.abs(made - (1 - np.exp(-gone))).max() < {1: 0.4, 5: 0.05, 16: 0.01, 200: 4e-4}[count]


@pytest.mark.parametrize("name", HISTORY)
def test_without_a_recording_nothing_is_carried(name):
    states = States.from_table(visits())
    with torch.no_grad():
        shown = build_model("linear", TRUTH["linear"] | labels_of(name, "scale"), [name])(states).loads
        bare = build_model("linear", TRUTH["linear"])(states).loads
    assert torch.equal(shown, bare)


def test_a_fit_of_some_rows_has_all_that_was_before_them_behind_it():
    """Residuals and derivatives of every third row are those of the whole log."""
    states = States.from_table(recordings())
    model = build_model("continuum", TRUTH["continuum"] | labels_of("creep", "scale"), ["creep", "maxwell_slip"])
    rows = Rows.whole(states, torch.zeros(len(states), 2, dtype=torch.float64))
    some = torch.arange(2, len(states), 3)
    one = torch.ones(2, dtype=torch.float64)
    vector = model.vector().detach()[None]
    whole, part = Problem(model, rows, one), Problem(model, rows[some], one)
    torch.testing.assert_close(
        part.residuals(vector)[0].reshape(-1, 2), whole.residuals(vector)[0].reshape(-1, 2)[some]
    )
    size = vector.shape[1]
    torch.testing.assert_close(
        part.jacobians(vector)[0].reshape(-1, 2, size), whole.jacobians(vector)[0].reshape(-1, 2, size)[some]
    )


@pytest.mark.parametrize("effects", [["creep", "valve_flow", "sensor_lag"], ["force_gain", "maxwell_slip"]])
def test_derivatives_by_some_parameters_are_those_among_all(effects):
    states = States.from_table(recordings())
    values = TRUTH["continuum"] | {k: v for name in effects for k, v in labels_of(name, "scale").items()}
    model = build_model("continuum", values, effects)
    rows = Rows.whole(states, torch.zeros(len(states), 2, dtype=torch.float64))
    vector, labels = model.vector().detach(), model.labels()
    every = Problem(model, rows).jacobians(vector[None])[0].reshape(len(rows), 2, -1)
    for name in ("C1", *effects):
        some = [i for i, label in enumerate(labels) if label.startswith(name)]
        assert bool((every[..., some] != 0).any())
        torch.testing.assert_close(Problem(model, rows).columns(vector, some), every[..., some], rtol=1e-9, atol=1e-12)


def test_a_dead_load_creeps_to_where_it_would_hang_in_the_end():
    """A load is hung at once and stays: at first the wall is stiffer by 1 + g, in the end it is the elastic one."""
    table = recordings((3,))[:11].drop(columns=["elongation_mm", "twist_deg"]).assign(bed="dead_load", pressure_kpa=0.0)
    table["force_n"], table["moment_nmm"], table["time_s"] = -3.0, 0.0, np.r_[0.0, 1e-6, np.linspace(1, 300, 9)]
    table.loc[0, "force_n"] = 0.0
    states = States.from_table(table)
    values = TRUTH["linear"] | {"creep.share": 0.5, "creep.time": 2.0}
    with torch.no_grad():
        crept = build_model("linear", values, ["creep"])(states).loads[:, 0]
        elastic = build_model("linear", TRUTH["linear"])(states).loads[:, 0]
    assert float(crept[1] / elastic[1]) == pytest.approx(1 / 1.5, rel=1e-4)
    assert float(crept[-1] / elastic[-1]) == pytest.approx(1.0, rel=1e-6)
    assert bool((crept[1:].diff() >= -1e-12).all())


@pytest.mark.parametrize(("period", "damping"), [(0.3, 0.05), (2.0, 0.3), (0.8, 0.9)])
def test_what_swings_is_exact_between_samples(recording, period, damping):
    x, omega = recording.states.pressure, 2 * np.pi / period
    both = torch.tensor([period, period], dtype=torch.float64)
    y = rung(torch.stack([x, x], dim=1), recording, both, torch.tensor(damping, dtype=torch.float64))[:, 0]
    own = recording.run == 0
    time, signal = recording.time[own].numpy(), x[own].numpy()
    found = solve_ivp(
        lambda t, z: (z[1], omega**2 * (np.interp(t, time, signal) - z[0]) - 2 * damping * omega * z[1]),
        (time[0], time[-1]), [signal[0], 0.0], t_eval=time, rtol=1e-10, atol=1e-6, max_step=0.01,
    )  # fmt: skip
    np.testing.assert_allclose(y[own], found.y[0], rtol=1e-5, atol=1e-5 * np.abs(signal).max())


def behind_a_valve(resistance, time, command):
    """Gauge pressures [Pa] that the effect and the flow itself, by fine steps, make of a command in kPa; samples at
    times [s]."""
    table = recordings((3,))[:14]
    fine = pd.concat([table.iloc[[0]]] * len(time), ignore_index=True).assign(time_s=time, elongation_mm=0.0)
    states = States.from_table(fine.assign(pressure_kpa=command))
    effect = EFFECTS["valve_flow"]()
    p = effect.own(
        {
            "valve_flow.squared_resistance": torch.tensor(resistance**2, dtype=torch.float64),
            "valve_flow.critical": torch.tensor(0.3, dtype=torch.float64),
        }
    )
    found = effect.carry(states.pressure[:, None], states.recording, p)[:, 0]
    volume = np.pi * float(states.inner_radius[0]) ** 2 * float(states.reference_length[0])

    def rate(t, p):
        command = np.interp(t, time, states.pressure.numpy()) + 101_325.0
        high, low = max(p[0], command), min(p[0], command)
        sonic = max(low / high - 0.3, 0.0) / 0.7
        return [np.sign(command - p[0]) * high * np.sqrt(max(1 - sonic**2, 0.0)) / (resistance * volume)]

    begun = [command[0] * 1e3 + 101_325.0]
    solved = solve_ivp(rate, (0, time[-1]), begun, t_eval=time, rtol=1e-8, atol=1.0, max_step=1e-3)
    return found.numpy(), solved.y[0] - 101_325.0


@pytest.mark.parametrize("resistance", [1e4, 1e5, 3e5])
def test_a_valve_lets_through_what_iso_6358_says(resistance):
    """Up and down again, past the speed of sound."""
    time = np.linspace(0, 3, 150)
    found, expected = behind_a_valve(resistance, time, np.interp(time, [0, 0.3, 1.5, 1.8, 3], [0, 600, 600, 50, 50]))
    np.testing.assert_allclose(found, expected, atol=0.01 * 6e5)


@pytest.mark.parametrize("every", [0.1, 0.25, 0.5])
def test_a_valve_follows_ramps_whose_rows_are_as_far_apart_as_it_is_slow(every):
    """What it is behind by is known within a tenth of it in every row, and within a thirtieth in the root mean
    square: taken for the middle of each step's change, or for as far behind as it ends, it was off by a fifth."""
    time = np.arange(0, 12.1, every)
    command = np.interp(time, [0, 3, 6, 9, 12], [0.0, 39.0, 0.0, 39.0, 0.0])
    found, expected = behind_a_valve(3e5, time, command)
    late = np.abs(1e3 * command - expected).mean()
    assert late > 1e3
    assert np.abs(found - expected).max() < 0.1 * late
    assert np.sqrt(((found - expected) ** 2).mean()) < late / 30


def test_a_muscle_fills_as_a_valve_lets_it(shared_data):
    """Measured from a constant supply: the flow at the speed of sound, and then less; a lag is three times off."""
    raw = pd.read_csv(shared_data / "time/festo_fill/Experiment2Fill.csv")
    time, pressure = torch.tensor(raw["time_s"].to_numpy()), raw["pressure_kpa"].to_numpy() * 1e3
    start = [2.0, 6.2, 0.2]

    def left(slow, supply, begun):
        one = torch.ones_like(time)
        shown = filled((begun + ATMOSPHERE) * one, (supply + ATMOSPHERE) * one, time / slow, torch.tensor(0.07))
        return (shown - ATMOSPHERE).numpy() - pressure

    fit = least_squares(lambda p: left(p[0], 1e5 * p[1], 1e5 * p[2]), start)
    lag = least_squares(
        lambda p: 1e5 * (p[1] - (p[1] - p[2]) * np.exp(-time.numpy() / p[0])) - pressure, [1.0, 6.2, 0.2]
    )
    assert np.sqrt(np.mean(fit.fun**2)) < 0.01 * 6.2e5
    assert fit.cost < lag.cost / 9


def warmed(time, command, line, cooling):
    """Absolute pressure of an ideal gas in a closed volume, its mass and its energy followed by an adaptive solver.

    Mass and energy are in units of V/(R T₀) and V c_v/R: what comes in has the wall's temperature, what goes out the
    gas's."""

    def rates(t, z):
        mass, energy = z
        flow = (np.interp(t, time, command) - energy) / line
        warm = energy / mass
        return [flow, 1.4 * flow * (1.0 if flow > 0 else warm) - mass * (warm - 1.0) / cooling]

    begun = [command[0], command[0]]
    return solve_ivp(rates, (time[0], time[-1]), begun, t_eval=time, rtol=1e-9, atol=1e-3, max_step=0.01).y[1]


def carried_warm(states, line, cooling):
    values = {"gas_warming.time": line, "gas_warming.cooling": cooling}
    effect = EFFECTS["gas_warming"]()
    p = effect.own({name: torch.tensor(value, dtype=torch.float64) for name, value in values.items()})
    return effect.carry(states.pressure[:, None], states.recording, p)[:, 0].numpy()


def pressed(time, pressure):
    table = pd.concat([recordings((3,)).iloc[[0]]] * len(time), ignore_index=True)
    return States.from_table(table.assign(time_s=time, pressure_kpa=pressure))


@pytest.mark.parametrize(("line", "cooling"), [(0.3, 1.0), (0.02, 0.1), (1.0, 0.3), (0.4, 20.0)])
def test_gas_that_is_pressed_in_warms_as_its_energy_says(line, cooling):
    """Exactly while it is filled; vented again, but for the little that the gas left at another temperature."""
    time = np.linspace(0, 6, 121)
    states = pressed(time, np.interp(time, [0, 1.0, 3.0], [0, 300, 300]))
    command = states.pressure.numpy() + ATMOSPHERE
    expected = warmed(time, command, line, cooling) - ATMOSPHERE
    np.testing.assert_allclose(carried_warm(states, line, cooling), expected, rtol=1e-6, atol=1.0)
    back = pressed(time, np.interp(time, [0, 1.0, 3.0, 4.0], [0, 60, 60, 0]))
    expected = warmed(time, back.pressure.numpy() + ATMOSPHERE, line, cooling) - ATMOSPHERE
    np.testing.assert_allclose(carried_warm(back, line, cooling), expected, atol=0.015 * 60e3)


def test_a_warming_gas_lies_between_two_lags():
    """Cooled at once it keeps its temperature; never cooled it is pressed in κ = 1.4 times as quickly."""
    time = np.linspace(0, 6, 121)
    states = pressed(time, np.interp(time, [0, 1.0, 3.0, 3.2], [0, 300, 300, 0]))
    signal = states.pressure[:, None]
    for cooling, tau in ((1e-3, 0.4), (1e4, 0.4 / 1.4)):
        lagging = (signal - lag(signal, states.recording, torch.tensor(tau, dtype=torch.float64)))[:, 0]
        np.testing.assert_allclose(carried_warm(states, 0.4, cooling), lagging, atol=2e-3 * 300e3)


def test_a_sample_without_equilibrium_takes_no_other_with_it():
    """Its tube balloons: samples after it go on from what was, and other recordings know nothing of it."""
    model = build_model("continuum", {"C1": 8e4, "C2": 2e5}, ["creep", "sensor_lag"])
    table = recordings((3,)).assign(pressure_kpa=lambda t: t["pressure_kpa"] / 10)
    burst = table.assign(pressure_kpa=table["pressure_kpa"].where(table.index != 5, 5e3))
    with torch.no_grad():
        calm, (loads, status) = model(States.from_table(table)).loads, model(States.from_table(burst))
    first = (burst["run"] == burst["run"].iloc[5]).to_numpy()
    assert status.nonzero().flatten().tolist() == [5]
    assert loads[torch.arange(len(loads)) != 5].isfinite().all()
    np.testing.assert_allclose(loads[~first], calm[~first], rtol=1e-10)
    np.testing.assert_allclose(loads[:5], calm[:5], rtol=1e-10)
