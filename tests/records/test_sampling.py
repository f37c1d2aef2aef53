"""Times that are over before a log's next row are told once, with the recording, its rate and what to do."""

import pandas as pd
import pytest
from fitted_folders import continuum

import freelearn as fl
from freelearn.physics.effects.registry import EFFECTS
from freelearn.records.sampling import sampling_notes
from freelearn.testing.reference.simulated_logs import log


@pytest.fixture(scope="module")
def table():
    """Recordings 1 and 2 have ten rows a second, 3 and 4 four."""
    fast, slow = (log({"supply_lag": {"time": 0.02}}, 3, recordings=2, rate=rate) for rate in (10.0, 4.0))
    return pd.concat([fast, slow.assign(run=slow["run"] + 2)], ignore_index=True)


@pytest.mark.parametrize(
    ("effects", "told"),
    [
        ({"supply_lag": {"time": 0.02}}, "In run 3, sampled every 0.25 s, and in 3 more supply_lag.time = 0.02 s is"),
        ({"supply_lag": {"time": 0.15}}, "In run 3, sampled every 0.25 s, and in 1 more supply_lag.time = 0.15 s is"),
        ({"sensor_lag": {"force": 0.02, "moment": 0.0}}, "and in 3 more sensor_lag.force = 0.02 s is over"),
        (
            {"sensor_lag": {"force": 0.02, "moment": 0.2}},
            "sensor_lag.force = 0.02 s and sensor_lag.moment = 0.2 s are over",
        ),
        (
            {"creep": {"share": 0.2, "time": 0.1}, "supply_lag": {"time": 1.0}},
            "rows within that time, or leave creep out.",
        ),
    ],
)
def test_what_is_over_before_the_next_row_is_told_once(table, effects, told):
    (said,) = sampling_notes(continuum(effects), table)
    assert told in said
    assert "record (or keep, rate_hz) several" in said


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"supply_lag": {"time": 0.3}},
        {"supply_lag": {"time": 0.0}},
        {"dead_time": {"delay": 0.02}},
        {"maxwell_slip": {"share": 0.5}},
    ],
)
def test_what_lasts_longer_what_is_not_there_and_delays_are_no_reason(table, effects):
    assert sampling_notes(continuum(effects), table) == []
    assert sampling_notes(continuum(effects), table.drop(columns="run")) == []


def test_a_fit_says_so(table, tmp_path):
    fitted = fl.fit(table, effects=["supply_lag"])
    fitted.save(tmp_path / "run")
    assert fitted.parameters["supply_lag.time"] < 0.1
    report = (tmp_path / "run" / "fit_report.txt").read_text()
    assert report.count("sampled every 0.25 s, and in 3 more supply_lag.time") == 1


@pytest.mark.nightly
def test_a_search_says_so(table):
    others = [name for name in EFFECTS if name not in ("supply_lag", "pressure_gain")]
    found = fl.discover(table, effects=["supply_lag"], ruled_out=others, bands=False, progress=False)
    assert found.summary().count("sampled every 0.25 s") == 1
