"""Identified actuators: what the package ships, and what others publish."""

import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import freelearn as fl

ROOT = Path(__file__).resolve().parents[2]


def test_the_shipped_muscle_has_its_sheet_and_answers_as_its_certificate_says():
    assert list(fl.actuators) == ["dmsp20"]
    assert repr(fl.actuators) == "fl.actuators: dmsp20"
    assert repr(fl.actuators["dmsp20"]).startswith("dmsp20: Pneumatic muscle Festo DMSP-20-300 (CC BY 4.0), ")
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


def test_a_folder_of_ones_own(traced, tmp_path):
    folder = fl.actuators.publish(traced, tmp_path / "left", title="Left", source="here", license="MIT")
    again = fl.actuators.open(folder)
    rows = traced.table().iloc[:5]
    np.testing.assert_array_equal(again.load().predict(rows).loads, traced.predict(rows).loads)
    assert again.card["referee"] == "not asked"
    with pytest.raises(fl.UserError, match="already"):
        fl.actuators.publish(traced, folder, title="Left", source="here", license="MIT")
    (folder / "actuator.json").write_text("{}")
    with pytest.raises(fl.UserError, match="no published actuator"):
        fl.actuators.open(folder)


@pytest.mark.nightly
def test_a_wheel_of_ones_own_is_listed_where_it_is_installed(traced, tmp_path):
    """As docs/export.md has it, word for word; the package itself is never imported."""
    package = tmp_path / "lab" / "lab_actuators"
    fl.actuators.publish(traced, package / "left", title="Left", source="here", license="MIT")
    (package / "__init__.py").write_text("raise ImportError('imported')")
    (project,) = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "export.md").read_text(), re.DOTALL)
    (tmp_path / "lab" / "pyproject.toml").write_text(project)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    alone = ["--no-deps", "--no-index"]
    built = ["wheel", *alone, "--no-build-isolation", "--wheel-dir", tmp_path / "wheels", tmp_path / "lab"]
    subprocess.run([*pip, *built], check=True, cwd=tmp_path)
    (wheel,) = (tmp_path / "wheels").glob("*.whl")
    assert wheel.name == "lab_actuators-1.0-py3-none-any.whl"
    subprocess.run([*pip, "install", *alone, "--target", tmp_path / "site", wheel], check=True)
    asked = "import freelearn as fl; print(*fl.actuators, round(fl.actuators['left'].load().parameters['ka']))"
    told = subprocess.run(
        [sys.executable, "-c", asked], env=os.environ | {"PYTHONPATH": str(tmp_path / "site")}, cwd=tmp_path,
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert told == ["dmsp20", "left", "30000"]


def test_of_two_actuators_of_one_name_both_are_told(traced, tmp_path, monkeypatch):
    for place in ("one", "two"):
        fl.actuators.publish(traced, tmp_path / place / "left", title="Left", source="here", license="MIT")
    monkeypatch.setattr("freelearn.api.actuators._libraries", lambda: [tmp_path / "one", tmp_path / "two"])
    assert list(fl.actuators) == ["dmsp20", "left"]
    with pytest.raises(fl.UserError, match=r"one/left and .*two/left"):
        fl.actuators["left"]


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("example", ["mujoco_arm", "fmu_arm", "c_arm"])
def test_an_arm_of_two_muscles_holds_a_load_by_feed_forward_pressures(example, monkeypatch):
    pytest.importorskip("mujoco")
    pytest.importorskip("fmpy")
    monkeypatch.syspath_prepend(ROOT / "experiments")
    if example != "c_arm":
        # Only this one asks its file for pressures: they take half the time to trace.
        monkeypatch.setattr("freelearn.export.actuator_functions.inverses", lambda actuator: [])
    held = runpy.run_path(str(ROOT / "experiments" / f"{example}.py"))["hold"](0.1, 0.25)
    assert held.reached == pytest.approx(held.wanted, abs=1e-3)
