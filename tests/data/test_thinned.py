"""Logs thinned through a low-pass: what is slow stays, what is fast is gone, and neither is hidden."""

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.common.errors import UserError
from freelearn.data.table.log_tables import thinned


def log(rate=500.0, seconds=20.0):
    """Stamps rounded to a millisecond; a slow wave, one at 47 Hz that ten rows a second would show as a slow one."""
    time = np.round(np.arange(0, seconds, 1 / rate) + 1e-4 * np.sin(np.arange(seconds * rate)), 3).clip(0)
    slow = np.sin(2 * np.pi * 0.3 * time)
    columns = {"gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    return pd.DataFrame(
        {
            "sample": 1, **columns, "step": np.arange(len(time)), "elongation_mm": 0.0, "twist_deg": 10.0,
            "pressure_kpa": 40 + 30 * slow, "force_n": slow + np.sin(2 * np.pi * 47.0 * time), "moment_nmm": 5.0,
            "buckled": 0, "time_s": time, "run": "a",
        }
    )  # fmt: skip


def test_what_is_slow_stays_and_what_is_fast_is_gone_and_told():
    made, place, (said,) = thinned(log(), 10.0)
    assert len(made) == 200
    slow = np.sin(2 * np.pi * 0.3 * made["time_s"])
    inner = slice(5, -5)
    np.testing.assert_allclose(made["force_n"][inner], slow[inner], atol=5e-3)
    np.testing.assert_allclose(made["pressure_kpa"][inner], 40 + 30 * slow[inner], atol=0.04)
    np.testing.assert_allclose(log()["time_s"].to_numpy()[place], made["time_s"], atol=2e-3)
    assert "500 Hz were thinned to 10 Hz" in said
    assert "10000 rows became 200" in said
    assert "0.7 of force_n" in said or "0.71 of force_n" in said


def test_marks_blanks_and_gaps_are_kept():
    table = log()
    table.loc[2000:2600, "force_n"] = np.nan
    table.loc[5000, "buckled"] = 1
    made = thinned(table.drop(index=range(7000, 8000)), 10.0)[0]
    assert 10 <= int(made["force_n"].isna().sum()) <= 13
    assert int(made["buckled"].sum()) == 1
    assert 178 <= len(made) <= 182
    assert made["time_s"].diff().max() == pytest.approx(2.0, abs=0.11)


def test_stamps_that_repeat_are_one_row_where_a_log_is_thinned(tmp_path):
    table = log(seconds=4.0)
    table.loc[101, "time_s"] = table.loc[100, "time_s"]
    path = tmp_path / "log.csv"
    table.to_csv(path, index=False)
    with pytest.raises(UserError, match="rate_hz"):
        fl.read_table(path)
    read = fl.read_table(path, rate_hz=20.0)
    assert len(read) == 80
    assert any("thinned to 20 Hz" in warning for warning in read.attrs["warnings"])


def test_a_slow_log_stays_and_a_table_without_recordings_is_refused():
    slow = log(rate=5.0)
    made, _, said = thinned(slow, 10.0)
    assert made is slow
    assert said == []
    with pytest.raises(UserError, match="rate_hz is for logs"):
        thinned(slow.drop(columns="run"), 10.0)
    with pytest.raises(UserError, match="no rate"):
        thinned(slow, 0.0)
