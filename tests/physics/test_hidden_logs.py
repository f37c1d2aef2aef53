"""Effects of the history, hidden by small steps of integration in logs of a bed apart, are found again by a fit."""

import numpy as np
import pytest
import torch
from nightly import usually

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import with_delay
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.numpy_peer import continuum
from freelearn.testing.reference.simulated_logs import C1, C2, UNIT, log
from freelearn.testing.reference.total_energy import severity, state_of

OPTIONS = FitOptions("levenberg_marquardt", max_epochs=60, restarts=1, patience=6)
# Five rows a swing are few; gas is vented at its own temperature; an error function is no hyperbolic tangent.
WITHIN = {"inertia": 0.1, "gas_warming": 0.1, "stress_softening": 0.1}
# No pressure here comes to the speed of sound.
UNTOLD = ["valve_flow.critical"]


@pytest.mark.parametrize("name", usually(*(name for name in UNIT if name != "valve_flow"), nightly=["valve_flow"]))
def test_a_fit_finds_what_small_steps_have_hidden(name):
    """Hardly any noise: what is left is the error of straight lines between the rows, and of few elements."""
    rows = Rows.from_table(log({name: UNIT[name]}, 1, recordings=4, rate=10.0, seconds=10.0, noise=0.02))
    model, bare = build_model("continuum", effects=[name]), build_model("continuum", {"C1": C1, "C2": C2})
    fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
    found = model.scalars()
    for label, value in UNIT[name].items():
        if value and f"{name}.{label}" not in UNTOLD:
            assert found[f"{name}.{label}"] == pytest.approx(value, rel=WITHIN.get(name, 0.05)), label
    left, lost = (Problem(m, rows).residual(m.vector()).detach().square().mean() ** 0.5 for m in (model, bare))
    assert left < 0.2 * lost


@pytest.mark.parametrize("delay", [8.0, -5.0])
def test_a_fit_finds_a_delay_of_which_the_next_row_shows_nothing(delay):
    """Longer than most holds: from none on no step of a fit leads there."""
    rows = Rows.from_table(log({"dead_time": {"delay": delay}}, 1, recordings=4, rate=5.0, seconds=20.0))
    model = build_model("continuum", effects=["dead_time"])
    fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
    assert model.scalars()["dead_time.delay"] == pytest.approx(delay, abs=0.02)


def test_a_delay_begins_where_the_readings_follow_best_and_others_stay():
    effects = {"dead_time": {"delay": 3.0}}
    rows = Rows.from_table(log(effects, 2, recordings=3, rate=5.0, seconds=20.0))
    far = build_model("continuum", {"C1": 3e5, "C2": 1e7}, effects=["dead_time"])
    start = far.vector().detach()
    moved = with_delay(far, rows, start)
    assert moved[-1] == pytest.approx(3.0, rel=0.25)
    assert torch.equal(moved[:-1], start[:-1])
    plain = build_model("continuum", {"C1": 3e5, "C2": 1e7}, effects=["supply_lag"])
    assert torch.equal(with_delay(plain, rows, plain.vector().detach()), plain.vector().detach())
    # What comes at once stays where it was.
    prompt = Rows.from_table(log({}, 2, recordings=3, rate=5.0, seconds=20.0))
    assert torch.equal(with_delay(far, prompt, start), start)


def test_a_second_creep_makes_a_series_of_two_arms():
    """Loads by small steps of a wall with two times: what a fit finds relaxes alike at every time after a step."""
    arms = {"creep": {"share": 0.15, "time": 0.5}, "second_creep": {"share": 0.25, "time": 8.0}}
    rows, left = Rows.from_table(log(arms, 1, recordings=4, rate=10.0, seconds=20.0, noise=0.0)), {}
    for effects in (["creep"], ["creep", "second_creep"]):
        model = build_model("continuum", effects=effects)
        fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
        left[len(effects)] = float(Problem(model, rows).residual(model.vector()).detach().square().mean() ** 0.5)
    assert left[2] < 0.1 * left[1]
    (fast, one), (slow, two) = sorted(
        (model.scalars()[f"{name}.time"], model.scalars()[f"{name}.share"]) for name in effects
    )
    found = {fast: one * (1 + two * slow / (slow - fast)), slow: two * (1 - one * fast / (slow - fast))}
    time = np.geomspace(0.1, 20.0, 30)
    true = {arm["time"]: arm["share"] for arm in arms.values()}
    curves = [1 + sum(g * np.exp(-time / tau) for tau, g in series.items()) for series in (true, found)]
    np.testing.assert_allclose(curves[1], curves[0], rtol=0.01)


def test_a_single_lag_stands_for_seven_eighths_of_a_warming_gas():
    """Of what the gas does to the readings, refitted with C1 and C2: so short lines leave the two a class."""
    name = "gas_warming"
    rows = Rows.from_table(log({name: UNIT[name]}, 1, recordings=4, rate=10.0, seconds=10.0, noise=0.02))
    left = {}
    for effects in ((), ("supply_lag",)):
        model = build_model("continuum", effects=list(effects))
        fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
        left[effects] = float(Problem(model, rows).residual(model.vector()).detach().square().mean() ** 0.5)
    assert left["supply_lag",] / left[()] == pytest.approx(1 / 8, abs=0.02)


def test_rubber_remembers_the_worst_of_all_recordings_so_far_sample_by_sample():
    """The rule as a loop, row after row: the largest severity that this actuator has been through, in whichever
    recording; severities by bisection. A recording by itself is looked at with its own past alone."""
    table = log({}, 2, samples=(3, 4), recordings=3, rate=4.0, seconds=8.0, noise=0.0)
    states, worst, expected = States.from_table(table), {3: 0.0, 4: 0.0}, []
    now, _ = severity(state_of(table))
    for sample, severe in zip(table["sample"], now, strict=True):
        worst[sample] = max(worst[sample], float(severe))
        expected.append(worst[sample])
    np.testing.assert_allclose(states.severity, now, atol=1e-9)
    np.testing.assert_allclose(states.past_severity, expected, atol=1e-9)
    later = ((table["sample"] == 3) & (table["run"] > 1)).to_numpy()
    assert (states.past_severity.numpy()[later] > now[later] + 1e-3).mean() > 0.5
    # Rows that are asked about alone know the past that they were measured with.
    part = torch.as_tensor(later.nonzero()[0][::3])
    assert torch.equal(states[part].past_severity, states.past_severity[part])


def test_a_softened_wall_is_softened_in_logs_as_the_source_says():
    """η = 1 − d tanh((S_max − S)/m) on the whole wall, of a log whose loads are integrated apart, row by row."""
    table = log({}, 2, samples=(4,), recordings=2, rate=4.0, seconds=8.0, noise=0.0)
    depth, step, worst, left = 0.3, 0.01, 0.0, []
    now, _ = severity(state_of(table))
    for severe in now:
        worst = max(worst, float(severe))
        left.append(1 - depth * np.tanh((worst - severe) / step))
    s = state_of(table)
    expected = continuum(
        s["gamma"], s["reference"], s["inner"], s["outer"], s["length"], s["twist"], s["pressure"],
        C1 * np.array(left), C2 * np.array(left),
    )  # fmt: skip
    model = build_model("continuum", {"C1": C1, "C2": C2}, effects=["stress_softening"])
    model.set_values({"stress_softening.depth": depth, "stress_softening.severity": step})
    with torch.no_grad():
        found = model(States.from_table(table)).loads
    np.testing.assert_allclose(found, np.stack(expected, axis=1), rtol=1e-6, atol=1e-7)
