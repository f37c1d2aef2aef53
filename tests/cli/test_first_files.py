"""The raw files of docs/starts.md: what a laboratory answers there makes the table that each was made of."""

import sys
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from rich.console import Console

from freelearn.cli.start_command import start

sys.path.insert(0, str(ROOT / "experiments"))

import first_files


@pytest.fixture
def made(tmp_path):
    """A function that makes the file of a name, starts it with its answers, and gives the table and what was said."""

    def run(name, make, **more):
        raw, left, told = tmp_path / name, list(first_files.ANSWERS[name]), StringIO()
        make(raw)
        following = start([raw], tmp_path / "out", Console(file=told, width=200), lambda _: left.pop(0), **more)
        assert left == []
        return pd.read_csv(tmp_path / "out" / f"{raw.stem}_table.csv"), following, told.getvalue()

    return run


def test_the_muscle(made):
    table, following, told = made("Muskel.xlsx", first_files.muscle)
    measured = pd.read_csv(ROOT / "freelearn/examples/dmsp_20_300.csv")
    names = ["gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "elongation_mm", "twist_deg"]
    names += ["pressure_kpa", "force_n", "slack", "step"]
    pd.testing.assert_frame_equal(table[names], measured[names], check_dtype=False)
    assert following.command == "discover"
    assert "formulas that sum up other cells are no readings and were left out: C131 =AVERAGE(C5:C130)" in told


def test_the_free(made):
    table, following, _ = made("free.mat", first_files.free)
    assert len(table) == 225
    assert table.loc[0, ["gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]].tolist() == [
        36,
        98.4,
        4.77,
        6.74,
    ]
    # At rest a spring, and what pulls as the pressure rises.
    rest = table[table["step"] == 0]
    assert np.corrcoef(rest["twist_deg"], rest["moment_nmm"])[0, 1] < -0.8
    assert "data.accuracy=estimate" in following.words


def test_the_three_actuators(made, tmp_path):
    table, _, told = made("three.mat", first_files.three)
    members = pd.read_csv(tmp_path / "out" / "three_table_members.csv")
    for number, (angle, _, length, inner, outer) in first_files.THREE.items():
        row = members[members["member"] == number].iloc[0]
        assert row[["gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]].tolist() == [
            angle,
            length,
            inner,
            outer,
        ]
    assert {"pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa"} <= set(table)
    assert "Gamma, L, Ri, Ro will be proposed" in told


def test_the_artery(made):
    table, following, _ = made("artery.csv", first_files.artery)
    assert "data.bed=inflation" in following.words
    assert sorted(table["elongation_mm"].unique()) == pytest.approx([4, 6, 8, 10])
    # A wall that is 3.5 mm wide at rest, pulled long and swollen; held longer than at rest it pulls.
    assert table["outer_diameter_mm"].between(2, 8).all()
    assert (table["force_n"] < 0).all()
    assert table["pressure_kpa"].max() == pytest.approx(140 * first_files.MMHG, rel=0.02)


def test_the_trajectory(made, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    rows = pd.DataFrame({"sample": 1, "length_mm": 300.0, "elongation_mm": [0, -60], "twist_deg": 0.0})
    rows.to_csv(run / "predictions.csv", index=False)
    table, following, _ = made("Bahn.xlsx", first_files.trajectory, run=run)
    assert following.command == "predict"
    assert table.iloc[0].to_dict() == {"sample": 1, "time_s": 0, "elongation_mm": -18, "twist_deg": 0, "force_n": -300}
    assert table["elongation_mm"].min() == -42


def test_the_rubber(made, shared_data):
    table, following, _ = made("Treloar.xlsx", lambda path: first_files.rubber(path, shared_data))
    assert following.command == "specimens"
    for mode, name in (("uniaxial", "UT"), ("equibiaxial", "ET"), ("pure_shear", "PS")):
        measured = pd.read_csv(shared_data / "rubber/treloar_1944" / f"{name}.csv")
        rows = table[table["mode"] == mode]
        np.testing.assert_allclose(rows["stretch"], measured["lambda"], atol=1e-4)
        np.testing.assert_allclose(rows["stress_mpa"], measured["P_MPa"], atol=1e-5)
