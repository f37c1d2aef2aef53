"""FMU, table and MuJoCo, each in the software that it is for."""

import numpy as np
import pytest
from fitted_folders import folder_of, grid, shown

import freelearn
from freelearn.common.errors import UserError
from freelearn.data.beds import DEG, KPA, MM
from freelearn.export.writers.c_file import compiler
from freelearn.physics.models.build import build_model


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_fmpy_simulates_what_predict_answers(traced, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    found = traced.export(tmp_path / "arm.fmu")
    assert found.held
    assert fmpy.supported_platforms(str(found.files[0])) == ["c-code", "linux64"]
    rows = traced.table().iloc[5:9]
    given = np.zeros(4, dtype=[("time", float), ("elongation", float), ("twist", float), ("pressure", float)])
    given["time"] = np.arange(4)
    given["elongation"], given["twist"] = rows["elongation_mm"] * MM, rows["twist_deg"] * DEG
    given["pressure"] = rows["pressure_kpa"] * KPA
    result = fmpy.simulate_fmu(
        str(found.files[0]), stop_time=3.0, output_interval=1.0, step_size=1.0, input=given, output=["force", "inside"]
    )
    # Each step begins with the inputs of its start.
    np.testing.assert_allclose(result["force"][1:], rows["force_pred_n"][:3], rtol=1e-6)
    assert (result["inside"][1:] == 1).all()


def test_a_table_is_as_fine_as_was_asked_and_ends_with_the_data(traced, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5py")
    found = traced.export(tmp_path / "arm.nc", error=2e-3)
    assert 1e-5 < max(found.content["round_trip"]["largest_difference"].values()) <= 2e-3
    table = xarray.load_dataset(found.files[0], engine="h5netcdf")
    assert (table["force"].attrs["units"], table["pressure"].attrs["units"]) == ("N", "Pa")
    at = {"elongation": 1.3e-3, "twist": 0.4, "pressure": 3e4}
    asked = traced.predict(_states(1.3, 0.4 / DEG, 30.0)).loads[0]
    span = np.ptp(table["force"].to_numpy())
    assert abs(float(table["force"].interp(at)) - asked[0]) < 2e-3 * span
    assert np.isnan(float(table["force"].interp(at | {"pressure": 9e4})))


def test_mujoco_hangs_where_the_model_says(traced, tmp_path):
    pytest.importorskip("mujoco")
    found = traced.export(tmp_path / "arm.xml")
    assert found.held
    seen = found.content["simulated"]
    assert seen["commanded"] < 1e-9
    assert seen["hung"] < 1e-3
    assert seen["released"] < 1e-3
    assert 0 < found.content["affine"]["force"]["root_mean_square"] < 0.5


@pytest.mark.nightly
def test_what_a_format_cannot_hold_is_said(tmp_path):
    model = build_model("continuum", {}, ["sensor_drift"])
    model.set_values({"sensor_drift.force_rate": 1e-5})
    other = freelearn.load(folder_of(tmp_path / "run", model, shown(model, grid()), covariance=np.eye(4)))
    pytest.importorskip("h5netcdf")
    with pytest.raises(UserError, match=r"remembers \(clock\)"):
        other.export(tmp_path / "arm.nc")


def _states(elongation, twist, pressure):
    import pandas as pd

    return pd.DataFrame({"elongation_mm": [elongation], "twist_deg": [twist], "pressure_kpa": [pressure]})
