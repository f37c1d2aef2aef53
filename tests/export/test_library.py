"""Identified actuators: what the package ships, and what others publish."""

import json
import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from exported import actuator

import freelearn as fl

ROOT = Path(__file__).resolve().parents[2]


def test_the_shipped_muscle_has_its_sheet_and_answers_as_its_certificate_says():
    assert list(fl.actuators) == ["dmsp20"]
    muscle = fl.actuators["dmsp20"]
    sheet = muscle.sheet()
    assert "CC BY 4.0" in sheet
    assert "referee: " in sheet
    content = json.loads((muscle.folder / "export.json").read_text())
    assert content["round_trip"]["held"]
    # The measured force at 300 kPa and full length: some 1.4 kN of pull in the maker's data sheet.
    row = pd.DataFrame({"elongation_mm": [-4.0], "twist_deg": [0.0], "pressure_kpa": [300.0]})
    rows = muscle.load().table()
    near = rows[(rows["elongation_mm"].between(-5, -3)) & (rows["pressure_kpa"].between(280, 320))]
    assert len(near)
    assert muscle.load().predict(row).loads[0, 0] == pytest.approx(near["force_n"].mean(), rel=0.1)
    with pytest.raises(fl.UserError, match="dmsp20"):
        fl.actuators["dmsp21"]


def test_nothing_published_names_a_place_of_this_machine():
    for path in fl.actuators["dmsp20"].folder.iterdir():
        if path.suffix in (".json", ".csv"):
            assert str(ROOT) not in path.read_text()


def test_a_folder_of_ones_own(tmp_path):
    run = actuator(tmp_path / "run")
    folder = fl.actuators.publish(run, tmp_path / "left", title="Left", source="here", license="MIT")
    again = fl.actuators.open(folder)
    rows = run.table().iloc[:5]
    np.testing.assert_array_equal(again.load().predict(rows).loads, run.predict(rows).loads)
    assert again.card["referee"] == "not asked"
    with pytest.raises(fl.UserError, match="already"):
        fl.actuators.publish(run, folder, title="Left", source="here", license="MIT")
    (folder / "actuator.json").write_text("{}")
    with pytest.raises(fl.UserError, match="no published actuator"):
        fl.actuators.open(folder)


@pytest.mark.slow
@pytest.mark.parametrize("example", ["mujoco_arm", "fmu_arm", "c_arm"])
def test_an_arm_of_two_muscles_holds_a_load_by_feed_forward_pressures(example, monkeypatch):
    pytest.importorskip("mujoco")
    pytest.importorskip("fmpy")
    monkeypatch.syspath_prepend(ROOT / "experiments")
    held = runpy.run_path(str(ROOT / "experiments" / f"{example}.py"))["hold"](0.1, 0.25)
    assert held.reached == pytest.approx(held.wanted, abs=1e-3)
