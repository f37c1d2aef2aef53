"""Bands of curves: those that a prediction has, only where rows tell them, and areas that fill evenly."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import torch
from small_runs import make_csv, run

import freelearn
from freelearn.data.beds import NMM
from freelearn.data.columns import usable_rows
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.queries.curves.curve_panels import curve_numbers
from freelearn.queries.curves.model_curves import state_curves, strip
from freelearn.queries.curves.run_curves import run_bands, run_curves
from freelearn.queries.curves.shown_states import pick_states
from freelearn.records.run_files import predictions, training_samples

ENDS = ["force_pred_n_low", "force_pred_n_high", "moment_pred_nmm_low", "moment_pred_nmm_high"]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return make_csv(tmp_path_factory.mktemp("bands") / "table.csv", rows=1200)


@pytest.fixture(scope="module")
def fitted(table):
    """A run on one of two samples: its result, its folder, the rows of that sample."""
    folder = table.parent / "run"
    outcome = run(folder, "train=sample3", "data=csv", f"data.path={table}", "figures=false")
    return outcome, folder, training_samples(outcome, predictions(outcome))


def test_they_are_those_of_a_prediction(fitted):
    outcome, folder, own = fitted
    bands = run_bands(outcome, own, Rows.from_table(own), by_states=False)
    states = States.from_table(own)
    curves = run_curves(outcome, own, banded=True, by_states=False)
    assert len(curves) == 3
    for rows, (measured, lines) in zip(pick_states(own), curves, strict=True):
        curve = lines["continuum"]
        with torch.no_grad():
            shown = outcome.model(states[torch.as_tensor(rows)]).loads
        half = bands.half(states[torch.as_tensor(rows)], shown)
        assert np.isfinite(half).all()
        # The path ends each of its stretches at a measured row.
        for i, pressure in enumerate(measured["pressure_kpa"]):
            at = curve.iloc[(curve["pressure_kpa"] - pressure).abs().argmin()]
            for j, (name, factor) in enumerate((("force_pred_n", 1.0), ("moment_pred_nmm", NMM))):
                low, high = at[f"{name}_low"], at[f"{name}_high"]
                assert (high - low) / 2 == pytest.approx(half[i, j] / factor, rel=1e-6)
                assert (high + low) / 2 == pytest.approx(at[name], rel=1e-9, abs=1e-9)
    # What is taken up again from the folder says the same.
    again = freelearn.load(folder).predict(own.iloc[pick_states(own)[0]])
    first = run_bands(outcome, own, Rows.from_table(own), by_states=False)
    place = torch.as_tensor(pick_states(own)[0])
    np.testing.assert_allclose(again.half, first.half(states[place], torch.as_tensor(again.loads)), rtol=1e-5)


def test_they_end_where_nothing_tells_them(fitted):
    outcome, _, own = fitted
    bands = {"m": run_bands(outcome, own, Rows.from_table(own), by_states=False)}

    def curve(table):
        rows = pick_states(table)[0]
        return state_curves({"m": outcome.model}, table, [rows], bands=bands)[0][1]["m"]

    whole = curve(own.reset_index(drop=True))
    assert whole.loc[~whole["extrapolated"], ENDS].notna().all(axis=None)
    # Beyond the measured pressures.
    high = own.reset_index(drop=True).assign(buckled=(own["pressure_kpa"] > 45).to_numpy(int))
    part = curve(high)
    assert part["extrapolated"].any()
    assert part.loc[part["extrapolated"], ENDS].isna().all(axis=None)
    assert part.loc[~part["extrapolated"], ENDS].notna().all(axis=None)
    # Where the tube hangs loose, though a row was measured there and the line is drawn whole.
    slack = curve(own.reset_index(drop=True).assign(slack=(own["pressure_kpa"] < 25).to_numpy(int)))
    assert not slack.loc[slack["pressure_kpa"].between(10, 25), "extrapolated"].any()
    assert slack.loc[slack["pressure_kpa"] < 29, ENDS].isna().all(axis=None)
    assert slack.loc[slack["pressure_kpa"] > 31, ENDS].notna().all(axis=None)
    # Of an actuator that the model was never compared with.
    other = predictions(outcome).query("sample == 6").reset_index(drop=True)
    assert curve(other)[ENDS].isna().all(axis=None)
    # Without any band there is no column of one.
    assert not set(ENDS) & set(state_curves({"m": outcome.model}, own, [np.arange(10)])[0][1]["m"])


def test_without_an_equilibrium_there_is_none_and_nothing_breaks(fitted):
    outcome, _, own = fitted
    bands = {"m": run_bands(outcome, own, Rows.from_table(own), by_states=False)}
    ballooning = own.reset_index(drop=True).assign(pressure_kpa=own["pressure_kpa"].to_numpy() * 3e4)
    rows = np.flatnonzero(usable_rows(ballooning))[:10]
    curve = state_curves({"m": outcome.model}, ballooning, [rows], bands=bands)[0][1]["m"]
    lost = curve["force_pred_n"].isna()
    assert lost.any()
    assert curve.loc[lost, ENDS].isna().all(axis=None)


def test_the_numbers_beside_a_picture_have_them(fitted):
    outcome, _, own = fitted
    (measured, lines), *_ = run_curves(outcome, own, banded=True, by_states=False)
    numbers = curve_numbers(measured, lines)
    ends = ["force_n_low", "force_n_high", "moment_nmm_low", "moment_nmm_high"]
    assert list(numbers) == ["what", "pressure_kpa", "force_n", "moment_nmm", *ends, "extrapolated"]
    model = numbers[numbers["what"] == "continuum"]
    np.testing.assert_allclose(model["force_n_high"], lines["continuum"]["force_pred_n_high"])
    assert numbers.loc[numbers["what"] == "measured", ends].isna().all(axis=None)
    (measured, lines), *_ = run_curves(outcome, own, banded=False, by_states=False)
    assert list(curve_numbers(measured, lines)) == ["what", "pressure_kpa", "force_n", "moment_nmm", "extrapolated"]


@pytest.mark.nightly
def test_the_switch_is_for_pictures_alone(table, tmp_path):
    given = ["train=sample3", "data=csv", f"data.path={table}"]
    pages = {}
    for switch in ("true", "false"):
        run(tmp_path / switch, *given, f"bands={switch}", "figures=true")
        pages[switch] = (tmp_path / switch / "report.html").read_text()
    with_bands, without = (json.loads((tmp_path / name / "results.json").read_text()) for name in pages)
    times = {"seconds", "fit_seconds"}
    assert all(with_bands[name] == without[name] for name in with_bands if name not in times)
    told = "Shaded: where a new measurement lies with 95 % probability"
    assert (told in pages["true"], told in pages["false"]) == (True, False)


@pytest.mark.nightly
def test_a_run_of_which_nobody_knows_the_accuracy_has_them_too(tmp_path):
    few = make_csv(tmp_path / "few.csv", rows=60)
    table = pd.read_csv(few)
    table[table["sample"] == table["sample"].iloc[0]].iloc[:30].to_csv(few, index=False)
    outcome = run(
        tmp_path / "run", "train=all", "data=csv", f"data.path={few}", "data.accuracy=estimate", "figures=true"
    )
    assert outcome.accuracy is None
    text = re.sub(r"<script.*?</script>", "", (tmp_path / "run" / "report.html").read_text(), flags=re.DOTALL)
    assert "Shaded" in text


def area(points):
    """Signed, of what is run around by one end and back by the other."""
    around = np.r_[points[:, :2], points[::-1, ::2]]
    x, y = around.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def frame(pressure, low, high):
    columns = {"pressure_kpa": pressure, "force_pred_n_low": low, "force_pred_n_high": high}
    return pd.DataFrame({name: np.asarray(values, dtype=float) for name, values in columns.items()})


def test_an_area_is_run_around_in_one_sense_and_skips_what_is_blank():
    pressure = np.array([0, 10, 20, 30, 20, 10])
    both = strip(frame(pressure, np.zeros(6), np.full(6, 2.0)), "pressure_kpa", "force_pred_n")
    # Up and down again: twice the same area, and not nothing.
    assert area(both) == pytest.approx(2 * 30 + 2 * 20)
    gap = strip(frame(pressure[:4], [0, np.nan, 0, 0], [2, np.nan, 2, 2]), "pressure_kpa", "force_pred_n")
    assert np.isfinite(gap).all()
    assert area(gap) == pytest.approx(2 * 10)
    # A gap is bridged without width, wherever the band goes meanwhile.
    pair = strip(frame([0, 1, 2, 3, 4], [0, 0, np.nan, 50, 50], [2, 2, np.nan, 54, 54]), "pressure_kpa", "force_pred_n")
    assert area(pair) == pytest.approx(2 + 4)
    for nothing in (frame([0, 1], [np.nan] * 2, [np.nan] * 2), pd.DataFrame({"pressure_kpa": [0.0, 1.0]})):
        assert len(strip(nothing, "pressure_kpa", "force_pred_n")) == 0
