"""What changes over a session, within recordings or with work refutes a claim: on logs of the bed apart."""

import re
from functools import partial

import numpy as np
import pytest
from linear_bed import SHORT, bench
from nightly import usually

from freelearn.data.accuracy import PAPER
from freelearn.data.logs import session_clock
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.referee.case import FAIL, PASS, Case
from freelearn.discovery.referee.referee import Referee
from freelearn.discovery.referee.steadiness import steadiness
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import log

SAMPLE = 4


def checks(hidden, claimed, seed=1):
    """Of what is claimed of a log that hides this."""
    rows = Rows.from_table(log(hidden, seed, (SAMPLE,)))

    def build(names):
        return build_model("continuum", {}, list(names), [SAMPLE])

    prepared, fit, noise = prepare(Question(build, [], rows, PAPER, 0, given=claimed))
    case = Case(fit, None, prepared.rows, noise.whitener(), prepared.scale, PAPER, prepared.fold, claimed)
    return {check.name.removeprefix("steady "): check for check in steadiness(case)}


def told(check):
    """The two values that it tells."""
    number = r"([-−+]?[\d.]+(?:e[-+−]?\d+)?)"
    return [float(x.replace("−", "-")) for x in re.search(rf" is {number}.* and {number}", check.says).groups()]


@pytest.mark.parametrize(
    ("hidden", "claimed"),
    [
        pytest.param({}, [], marks=pytest.mark.nightly),
        ({"creep": {"share": 0.1, "time": 3.0}}, ["creep"]),
        pytest.param({"supply_lag": {"time": 0.15}}, ["supply_lag"], marks=pytest.mark.nightly),
        ({"force_gain": {"gain": 0.03}}, ["force_gain"]),
    ],
)
def test_what_is_steady_and_right_passes(hidden, claimed):
    assert {check.result for check in checks(hidden, claimed).values()} == {PASS}


@pytest.mark.parametrize("shape", usually("linear", "wave", nightly=["settling", "step"]))
def test_a_gain_that_drifts_is_no_gain(shape):
    check = checks({f"drifting force gain, {shape}": {"gain": 0.03}}, ["force_gain"])["over the session"]
    assert check.result == FAIL
    assert "Measure what was measured first once more at the end" in check.says
    assert Referee([check]).verdict("named") == "unexplained"


def test_the_two_ends_are_those_of_what_drifts():
    """A fifth more at the end than at the beginning, in C1; four percent in the gain; 0.3 N in the zero."""
    stiffer = checks({"drifting stiffness, linear": {"share": 0.2}}, [])["over the session"]
    assert "C1" in stiffer.says
    first, last = told(stiffer)
    assert last / first == pytest.approx(1.2, rel=0.05)
    # The means of the first and of the last tenth of the session are nine tenths of it apart.
    larger = checks({"drifting force gain, linear": {"gain": 0.04}}, ["pressure_offset"])["over the session"]
    first, last = told(larger)
    assert "gain of the force" in larger.says
    assert last - first == pytest.approx(0.9 * 0.04, rel=0.2)
    higher = checks({"drifting force zero, linear": {"force": 0.3}}, ["pressure_gain"])["over the session"]
    first, last = told(higher)
    assert "zero of the force" in higher.says
    assert last - first == pytest.approx(0.9 * 0.3, rel=0.2)


@pytest.mark.parametrize("claimed", usually(["pressure_gain", "relaxation"], nightly=[["force_gain", "moment_gain"]]))
def test_a_wall_that_warms_as_it_is_worked_is_neither_gain_nor_relaxation(claimed):
    check = checks({"warming": {"share": 0.02}}, claimed)["with work"]
    assert check.result == FAIL


def test_a_table_without_a_time_is_asked_in_the_order_of_its_rows():
    """A gain that rises by three percent, most of it at first: what is left looked like nothing."""

    def rising(states, loads):
        share = np.arange(len(loads)) % 120 / 120
        return loads * np.stack([1 + 0.03 * (1 - np.exp(-5 * share)), np.ones(len(loads))], axis=1)

    found = search(bench(51, **SHORT, extra=rising).question(["force_gain", "relaxation"]))
    (check,) = [c for c in found.referee.failed if c.name == "steady over the session"]
    assert "the gain of the force is 0.98" in check.says
    assert found.verdict == "unexplained"


def test_one_recording_has_no_session_beside_its_own_time():
    table = log({}, 1, (SAMPLE,), recordings=1)
    rows = Rows.from_table(table)
    assert float(rows.states.clock[-1]) == pytest.approx(float(rows.states.dwell[-1]))


def test_a_session_goes_on_where_stamps_begin_anew():
    """Stamps of one clock are kept, pauses too; those that begin anew are laid end to end, for each sample apart."""
    table = log({}, 1, (3, 4), recordings=3, seconds=4.0)
    time = table["time_s"].to_numpy()
    count = len(time) // 2
    np.testing.assert_allclose(session_clock(table), np.tile(0.2 * np.arange(count), 2), atol=1e-9)
    kept = table.assign(time_s=time + 100.0 * table["run"])
    np.testing.assert_allclose(session_clock(kept)[:count], (kept["time_s"] - 100.0).to_numpy()[:count])


@pytest.mark.parametrize("seed", [0, 2])
def test_a_gauge_s_errors_are_no_work(monkeypatch, seed):
    """Of a slow cell what changes with its time goes by the gauge, whose error in a row is in what is left there."""

    def growing(time, seconds, generator):
        turn = 6 * time / seconds
        return 10 * (np.floor(turn) + 1) * np.minimum(2 * (turn % 1), 2 - 2 * (turn % 1))

    measured = partial(log, recordings=2, rate=10.0, seconds=60.0, moves=False)
    monkeypatch.setattr("freelearn.testing.reference.simulated_logs.pressures", growing)
    monkeypatch.setitem(checks.__globals__, "log", measured)
    assert checks({"sensor_lag": {"force": 0.4, "moment": 0.3}}, ["sensor_lag"], seed)["with work"].result == PASS
