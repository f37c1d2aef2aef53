"""What pictures of a log show: extremes, rates, loops, spectra; against loops and closed forms written here."""

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

from freelearn.common.errors import UserError
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import FORCE, MOMENT, PRESSURE
from freelearn.queries.curves.log_spectra import log_spectra, spectrum_table
from freelearn.queries.curves.log_traces import extremes, loops_of, rates, trace_of, worst_recording

STATED = Accuracy.engineering(0.073, 0.175, 0.0, 0.03, 0.6)


def log(rate=50.0, seconds=60.0, runs=3, noise=0.03, seed=0, times=None):
    """Recordings at one place each; the model's loads, and white noise on the force as it is stated."""
    generator = np.random.default_rng(seed)
    time = np.arange(int(rate * seconds)) / rate if times is None else times
    pressure = 30 - 30 * np.cos(2 * np.pi * time / 12)
    parts = [
        pd.DataFrame(
            {"elongation_mm": run - 2.0, "twist_deg": 20.0 * run, "run": run, "time_s": time, "pressure_kpa": pressure}
        )
        for run in range(1, runs + 1)
    ]
    model = folders.continuum()
    table = pd.concat(parts, ignore_index=True).assign(**folders.design(3), buckled=0, step=0)
    table = folders.shown(model, table)
    predicted = table.assign(force_pred_n=table["force_n"], moment_pred_nmm=table["moment_nmm"], status="ok")
    predicted["force_n"] += noise * generator.normal(size=len(table))
    predicted["moment_nmm"] += 0.6 * generator.normal(size=len(table))
    return model, predicted


@pytest.mark.parametrize("seed", range(4))
def test_each_stretch_keeps_its_least_and_its_greatest(seed):
    generator = np.random.default_rng(seed)
    count, stretches = int(generator.integers(500, 3000)), int(generator.integers(5, 60))
    values = generator.normal(size=(count, 2)).cumsum(axis=0)
    values[generator.random((count, 2)) < 0.2] = np.nan
    kept = extremes(values, stretches)
    assert {0, count - 1} <= set(kept)
    assert np.all(np.diff(kept) > 0)
    assert len(kept) <= 4 * stretches + 2
    each = -(-count // stretches)
    for start in range(0, count, each):
        for column in values[start : start + each].T:
            inside = kept[(kept >= start) & (kept < start + each)] - start
            assert np.nanmin(column[inside]) == np.nanmin(column)
            assert np.nanmax(column[inside]) == np.nanmax(column)


def test_few_rows_are_all_kept_and_a_stretch_of_blanks_has_none():
    assert list(extremes(np.arange(7.0)[:, None], 4)) == list(range(7))
    values = np.concatenate([np.full(50, np.nan), np.arange(50.0)])[:, None]
    # The first and the last row always; of the blanks nothing else.
    assert list(extremes(values, 2)) == [0, 50, 99]


def test_a_rate_is_the_slope_whatever_the_spacing():
    time = np.sort(np.random.default_rng(1).uniform(0, 9, 400))
    assert rates(time, 5 - 3.5 * time) == pytest.approx(np.full(400, 3.5))


def test_a_channel_at_its_own_rate_is_drawn_where_it_has_a_number():
    _, table = log(rate=10, seconds=10, runs=1)
    table.loc[table.index % 4 != 0, "moment_nmm"] = np.nan
    table.loc[3, "buckled"] = 1
    trace = trace_of(table, PRESSURE, {"model": table})
    moment, force = trace.measured["moment_nmm"], trace.measured["force_n"]
    assert len(moment.time) == 25
    np.testing.assert_array_equal(moment.value, table["moment_nmm"].dropna())
    assert 0.3 not in force.time
    assert len(trace.imposed["pressure_kpa"].time) == 100
    assert trace.told == ""
    inside = trace_of(table, PRESSURE, {"model": table}, (2.0, 4.0)).imposed["pressure_kpa"].time
    assert (inside.min(), inside.max()) == (1.9, 4.0)


def test_many_samples_are_thinned_and_it_is_said_how_many_there_are():
    _, table = log(rate=500, seconds=40, runs=1)
    trace = trace_of(table, PRESSURE, {"model": table})
    force = trace.measured["force_n"]
    assert len(force.time) <= 1202
    assert (force.value.min(), force.value.max()) == (table["force_n"].min(), table["force_n"].max())
    assert "of 20,000 samples" in trace.told


def test_loops_are_of_each_recording_apart_and_know_how_fast_the_pressure_changes():
    _, table = log(rate=100, seconds=60, runs=2)
    table.loc[table["run"] == 2, "time_s"] *= 4
    loops = loops_of(table, PRESSURE, FORCE)
    assert set(loops.recording) == {0, 1}
    slow, fast = (loops.rate[loops.recording == run].max() for run in (1, 0))
    # The derivative of the cosine that the pressure follows.
    assert fast == pytest.approx(30 * 2 * np.pi / 12, rel=0.01)
    assert slow == pytest.approx(fast / 4, rel=0.01)


def test_the_worst_recording_is_that_with_the_largest_squared_error():
    _, table = log(runs=4, seconds=5)
    table.loc[table["run"] == 3, "moment_nmm"] += 20
    rows, sample = worst_recording(table)
    assert set(rows["run"]) == {3}
    assert len(sample) == len(table)


@pytest.mark.parametrize("uneven", [False, True])
def test_white_noise_lies_on_the_level_that_is_stated(uneven):
    times = None
    if uneven:
        times = np.arange(3000) / 50 + np.random.default_rng(3).uniform(-0.004, 0.004, 3000)
    model, table = log(times=times)
    force, moment = log_spectra(model, table, STATED)
    assert (force.quantity, moment.quantity) == (FORCE, MOMENT)
    # A white noise of variance s² has the one-sided density 2 s² over the rate; the pressure has no noise here.
    assert force.noise == pytest.approx(2 * 0.03**2 / 50, rel=1e-2)
    assert moment.noise == pytest.approx(2 * 0.6**2 / 50, rel=1e-2)
    # Between uneven samples a straight line smooths what is fast.
    slow = force.frequency < (10 if uneven else 25)
    assert np.mean(force.density[slow]) == pytest.approx(force.noise, rel=0.1)
    assert force.unit == "N²/Hz"
    assert moment.unit == "(N·mm)²/Hz"


def test_what_lasts_rises_at_its_own_frequency():
    model, table = log()
    table["force_n"] += 0.1 * np.sin(2 * np.pi * 2.0 * table["time_s"])
    force = log_spectra(model, table, STATED)[0]
    peak = force.density.argmax()
    assert force.frequency[peak] == pytest.approx(2.0, abs=0.1)
    assert force.density[peak] > 20 * force.noise
    # Its power is that of the sine: half the square of its amplitude.
    near = np.abs(force.frequency - 2.0) < 0.5
    power = np.sum(force.density[near] - force.noise) * (force.frequency[1] - force.frequency[0])
    assert power == pytest.approx(0.1**2 / 2, rel=0.1)


def test_the_noise_of_the_pressure_comes_in_by_the_models_slope():
    model, table = log(runs=1)
    quiet = log_spectra(model, table, STATED)[0].noise
    loud = log_spectra(model, table, Accuracy.engineering(0.073, 0.175, 2.0, 0.03, 0.6))[0].noise
    curve = np.polynomial.Polynomial.fit(table["pressure_kpa"], table["force_pred_n"], 6)
    expected = 2 * np.mean((2.0 * curve.deriv()(table["pressure_kpa"])) ** 2) / 50
    assert loud - quiet == pytest.approx(expected, rel=0.05)


def test_short_recordings_have_no_spectrum_and_tables_without_time_no_picture(tmp_path):
    model, table = log(rate=2, seconds=5)
    assert log_spectra(model, table, STATED) == []
    run = folders.fitted(tmp_path / "run", folders.continuum(), folders.shown(folders.continuum(), folders.grid()))
    for name in ("recording", "loops", "spectra"):
        with pytest.raises(UserError, match="no log"):
            getattr(run.plot, name)()


def test_a_table_tells_the_numbers_of_the_picture():
    model, table = log()
    spectra = log_spectra(model, table, STATED)
    shown = spectrum_table(spectra)
    own = shown[shown["quantity"] == "moment"]
    np.testing.assert_array_equal(own["density"], spectra[1].density)
    assert set(own["unit"]) == {"(N·mm)²/Hz"}


def test_a_run_draws_its_log(tmp_path):
    model, table = log(rate=20, seconds=30)
    run = folders.fitted(tmp_path / "run", model, table[[c for c in table if "pred" not in c and c != "status"]])
    pressure, force, moment = run.plot.recording()
    assert (pressure.get_ylabel(), force.get_xlabel()) == ("pressure P [kPa]", "time t [s]")
    measured = force.get_lines()[0]
    assert len(measured.get_xdata()) == 600
    assert {line.get_label() for line in moment.get_lines()} == {"measured", "model"}
    loops = run.plot.loops()
    assert [axes.get_xlabel() for axes in loops] == ["pressure P [kPa]"] * 2
    assert all(len(axes.collections) == 1 for axes in loops)
    force, moment = run.plot.spectra()
    assert force.get_xscale() == force.get_yscale() == "log"
    assert force.get_ylabel() == "power density [N²/Hz]"
