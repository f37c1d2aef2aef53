"""The recipes of experiments/recipes make tables of files that others measured."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT

from freelearn.common.csv_text import csv_text
from freelearn.data.beds import BEDS
from freelearn.data.intake.assemble import Intake
from freelearn.data.intake.convert import convert
from freelearn.data.intake.readers.raw_files import read_sources
from freelearn.data.intake.recipes.recipe_file import read_recipe, recipe_of
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members

RECIPES = ROOT / "experiments" / "recipes"
FILES = {
    "free70_single": "free70_single/raw.csv",
    "torsion_4angles": "torsion_4angles",
    "parallel_3": "parallel_3/plateaus_test9.csv",
    "parallel_free_end": "parallel_free_end/steps.csv",
    "dmsp_20_300": "braided_muscles/dmsp_20_300.csv",
    "festo_10mm": "braided_muscles/festo_10mm_isometric.csv",
    "vessels": "vessels/inflation_extension.csv",
}
PSI_KPA, LBF_IN_NMM = 6.894757, 112.98483


def taken(shared_data: Path, name: str) -> Intake:
    data = shared_data / FILES[name]
    if not data.exists():
        pytest.skip(f"the shared measurements hold no {FILES[name]}")
    recipe = read_recipe(RECIPES / f"{name}.yaml")
    return convert(recipe, read_sources(data, recipe))


def test_every_recipe_has_its_file():
    assert {path.stem for path in RECIPES.glob("*.yaml")} == set(FILES)


@pytest.mark.parametrize("name", FILES)
def test_every_table_is_one_that_train_reads(name, shared_data, tmp_path):
    intake = taken(shared_data, name)
    path, members = tmp_path / "table.csv", tmp_path / "members.csv"
    path.write_text(csv_text(intake.table))
    if intake.members is not None:
        members.write_text(csv_text(intake.members))
    bed = BEDS[read_recipe(RECIPES / f"{name}.yaml").bed]
    read = read_table(path, bed, read_members(members) if intake.members is not None else None)
    assert len(read.table) == len(intake.table) == len(intake.lines)


def test_the_single_free_is_the_table_that_was_made_by_hand(shared_data):
    made = taken(shared_data, "free70_single").table
    known = pd.read_csv(shared_data / "free70_single" / "measurements.csv")
    assert list(made.columns) == list(known.columns)
    np.testing.assert_allclose(made, known, atol=6e-5)


def test_torsion_under_hung_torques(shared_data):
    intake = taken(shared_data, "torsion_4angles")
    table = intake.table
    assert table["length_mm"].unique() == pytest.approx([3.4 * 25.4])
    assert table["inner_radius_mm"].unique() == pytest.approx([3 / 16 * 25.4])
    assert table["outer_radius_mm"].unique() == pytest.approx([6.35])
    assert (table["force_n"] == 0).all()
    # One bolt, two, three, and none.
    assert sorted(table["moment_nmm"].abs().round(4).unique() / LBF_IN_NMM) == pytest.approx(
        [0, 0.117933525, 0.23586705, 0.353800575], rel=1e-6
    )
    # The four rows of zeros at the end of one file.
    assert [file["dropped"] for file in intake.files] == [0, 0, 4, 0, 0, 0]
    raw = pd.read_csv(shared_data / "torsion_4angles" / "load60deg_v2.csv")
    made = table[(table["sample"] == 60) & (table["moment_nmm"] != 0)]
    np.testing.assert_allclose(made["pressure_kpa"], PSI_KPA * raw["Pressure (psi)"], rtol=1e-6)
    np.testing.assert_allclose(made["twist_deg"], -np.degrees(raw["dphi (rad)"]), rtol=1e-9)
    # Pressure turns a tube with a positive fiber angle the negative way, and a torque is borne against the twist.
    for _, rows in table[table["moment_nmm"] == 0].groupby("sample"):
        assert rows["pressure_kpa"].corr(rows["twist_deg"]) < -0.9
    lengths = table.groupby("sample")["elongation_mm"].apply(lambda column: column.notna().any())
    assert lengths.to_dict() == {20: False, 40: True, 41: True, 50: True, 60: True}


def test_three_frees_between_two_plates(shared_data):
    intake = taken(shared_data, "parallel_3")
    table, raw = intake.table, pd.read_csv(shared_data / FILES["parallel_3"])
    assert intake.members is not None
    assert intake.members["gamma_deg"].tolist() == [48, -48, -85]
    np.testing.assert_allclose(table["force_n"], -(raw["F_raw_N"] - raw["F_raw_N"][0]), atol=1e-9)
    np.testing.assert_allclose(table["moment_nmm"], 1000 * (raw["M_raw_Nm"] - raw["M_raw_Nm"][0]), atol=1e-9)
    assert table["elongation_mm"].nunique() == table["twist_deg"].nunique() == 2
    # Four states of 125 pressures each.
    assert (table["step"] == 0).sum() == 4
    assert table["step"].max() == 124
    # A tube resists: what it exerts falls with the length and with the twist.
    assert table["force_n"].corr(table["elongation_mm"]) < 0
    assert table["moment_nmm"].corr(table["twist_deg"]) < 0


def test_a_free_end_block(shared_data):
    table = taken(shared_data, "parallel_free_end").table
    assert len(table) == 414
    assert (table[["force_n", "moment_nmm"]] == 0).all(axis=None)
    assert table["pressure_3_kpa"].max() == pytest.approx(143.305)
    assert table["elongation_mm"].min() == pytest.approx(-3.375, abs=0.01)


def test_a_braided_muscle_pulls_and_hangs_loose(shared_data):
    intake = taken(shared_data, "dmsp_20_300")
    table, raw = intake.table, pd.read_csv(shared_data / FILES["dmsp_20_300"])
    assert "moment_nmm" not in table
    assert (table["force_n"] <= 0).all()
    assert table["slack"].sum() == (raw["force_n"] == 0).sum()
    assert ((table["slack"] == 1) == (table["force_n"] == 0)).all()
    assert sorted(table["elongation_mm"].round(6).unique()) == [-78, -63, -48.4, -33, -18, -4]
    assert (table.groupby("elongation_mm")["step"].max() == 20).all()
    assert (table.groupby("elongation_mm")["pressure_kpa"].diff().dropna() > 0).all()


def test_muscles_that_are_inflated_and_deflated(shared_data):
    intake = taken(shared_data, "festo_10mm")
    table = intake.table
    assert table["length_mm"].unique().tolist() == [83, 182, 281, 382]
    # Two tests of each muscle at each of four lengths.
    assert (table["step"] == 0).sum() == 4 * 4 * 2
    visit = (table["step"] == 0).cumsum()
    for _, rows in table.groupby(visit):
        branch = rows["branch"].tolist()
        assert branch == sorted(branch, reverse=True), "inflate comes before deflate"
    # The deflated gauge reads 73 kPa: taken off.
    ends = table.groupby(visit)["pressure_kpa"].last()
    assert ends.abs().max() < 10
    # A pull grows with the pressure.
    assert table.groupby("sample").apply(lambda rows: rows["force_n"].corr(rows["pressure_kpa"])).max() < -0.3


def test_the_gauge_of_the_muscles_is_suspicious_without_its_offset(shared_data):
    text = (RECIPES / "festo_10mm.yaml").read_text(encoding="utf-8").replace(", offset: 73", "")
    whole = text.replace("  - {branch: inflate, time_s: {below: 0.022}}", "  - {branch: none}")
    for recipe, says in ((text, "pressure_kpa is never below 48"), (whole, "pressure_kpa goes back to 7")):
        recipe = recipe_of(recipe, "recipe.yaml")
        intake = convert(recipe, read_sources(shared_data / FILES["festo_10mm"], recipe))
        assert any(says in warning for warning in intake.warnings)


def test_vessels(shared_data):
    table = taken(shared_data, "vessels").table
    raw = pd.read_csv(shared_data / FILES["vessels"])
    geometry = pd.read_csv(shared_data / "vessels" / "unloaded_geometry.csv")
    first = table.groupby("sample")[["length_mm", "inner_radius_mm", "outer_radius_mm"]].first()
    np.testing.assert_allclose(first, geometry[["L_mm", "IR_mm", "OR_mm"]], rtol=1e-9)
    np.testing.assert_allclose(table["pressure_kpa"], raw["P_kPa"], rtol=1e-4)
    np.testing.assert_allclose(table["outer_diameter_mm"], raw["od_mm"], rtol=1e-5)
    np.testing.assert_allclose(table["force_n"], -1e-3 * raw["F_mN"], rtol=1e-9)
    stretch = 1 + table["elongation_mm"] / table["length_mm"]
    np.testing.assert_allclose(stretch, raw["lambda_z"], atol=1e-3)
    # Seven tests of eight tubes; those at one stretch are one state each.
    held = table[table["test_kind"] == "biaxial_Pd"]
    assert (held["step"] == 0).sum() == 24
    assert held["step"].max() == 11
