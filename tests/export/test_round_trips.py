"""Every export beside the model itself."""

import json

import numpy as np
import pytest
import torch
from exported import actuator, already
from fitted_folders import folder_of, grid, shown

import freelearn
from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.checks import checked
from freelearn.export.export_options import Options
from freelearn.export.inverse import inverse
from freelearn.export.writers.c_file import compiler, run
from freelearn.export.writers.c_source import c_source
from freelearn.export.writers.onnx_file import write_onnx
from freelearn.physics.models.build import build_model

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
THREE = {"end_clamps": {"clamp_length": 2e-3}, "friction_hysteresis": {"force": 0.3, "moment": 2e-3},
         "stress_softening": {"depth": 0.1, "severity": 0.02}}  # fmt: skip


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    fitted = actuator(tmp_path_factory.mktemp("three"), THREE)
    functions = Functions(Actuator.from_fitted(fitted))
    # A pressure for a moment is looked for as one for a force is: `once` has both, of a model that is quickly traced.
    vars(functions)["inverses"] = [inverse(functions.loads.actuator, (0,))]
    with already(functions):
        found = fitted.export(tmp_path_factory.mktemp("c") / "left.c", license="CC-BY-4.0")
    return fitted, found, functions, run(found.files[0], "left")


def _named(functions):
    return {f.name: f for f in functions.every}


@needs_compiler
def test_c_answers_as_the_model_does_at_ten_thousand_states(three):
    _, found, *_ = three
    trip = found.content["round_trip"]
    assert found.held
    assert (trip["states"], trip["settled"], trip["outside"]["flagged"]) == (10_000, 10_000, 1.0)
    assert max(trip["largest_difference"].values()) < 1e-9
    assert [p.name for p in found.folder.iterdir() if p.suffix == ".c"] == ["left.c"]


@needs_compiler
def test_c_answers_a_table_in_the_order_of_measuring_as_predict_does(three):
    """Through `predict`, which knows nothing of exports; the state is handed on from call to call."""
    fitted, _, functions, library = three
    rows = fitted.table()
    answer = fitted.predict(rows)
    loads = _named(functions)["loads"]
    assert [p.name for p in loads.inputs] == ["elongation", "twist", "pressure", "direction", "worst_severity"]
    directions = np.sign(rows["pressure_kpa"].diff().fillna(0.0)) * (rows["step"] > 0)
    worst, got = 0.0, []
    for (_, row), direction in zip(rows.iterrows(), directions, strict=True):
        state = [row["elongation_mm"] * MM, row["twist_deg"] * DEG, row["pressure_kpa"] * KPA, direction, worst]
        out, flags = library.answers(loads, np.array([state]))
        assert flags[0] == 0
        worst = out[0, -1]
        got.append(out[0, :2])
    np.testing.assert_allclose(got, answer.loads, rtol=0, atol=1e-9 * np.ptp(answer.loads, axis=0).min())


@needs_compiler
def test_c_tells_bands_and_the_pressure_for_a_force_as_the_model_does(three):
    fitted, _, functions, library = three
    rows = fitted.table().iloc[2:60:7].reset_index(drop=True)[["sample", "elongation_mm", "twist_deg", "pressure_kpa"]]
    state = np.column_stack([rows["elongation_mm"] * MM, rows["twist_deg"] * DEG, rows["pressure_kpa"] * KPA])
    blank = np.zeros((len(rows), 2))
    table = fitted.invert(rows.assign(force_n=np.nan, moment_nmm=np.nan)).table()
    bands, _ = library.answers(_named(functions)["band"], np.c_[state, blank])
    half = (table["force_n_high"] - table["force_n_low"]) / 2
    np.testing.assert_allclose(bands[:, 0], half, rtol=1e-6)
    half = (table["moment_nmm_high"] - table["moment_nmm_low"]) / 2 * NMM
    np.testing.assert_allclose(bands[:, 1], half, rtol=1e-6)
    asked = fitted.invert(
        table[["sample", "elongation_mm", "twist_deg", "force_n"]].assign(pressure_kpa=np.nan)
    ).table()
    wanted = np.c_[state[:, :2], table["force_n"], blank]
    pressures, flags = library.answers(_named(functions)["pressure_for_force"], wanted)
    assert not flags.any()
    np.testing.assert_allclose(pressures[:, 0], asked["pressure_kpa"] * KPA, rtol=0, atol=1e-3)


@needs_compiler
def test_a_load_that_no_pressure_makes_is_flagged(three):
    *_, functions, library = three
    _, flags = library.answers(_named(functions)["pressure_for_force"], np.array([[0, 0, 1e4, 0, 0]]))
    assert flags[0] & 16


@pytest.mark.nightly
@needs_compiler
def test_a_ballooned_tube_is_flagged(tmp_path):
    """At its own pressures a soft wall without stiff fibers has no equilibrium; the C says so, as the model does."""
    model = build_model("continuum", {"C1": 8e4, "C2": 1e3}, [])
    fitted = freelearn.load(folder_of(tmp_path / "run", model, grid().assign(force_n=0.0, moment_nmm=0.0)))
    view = Functions(Actuator.from_fitted(fitted)).view
    (tmp_path / "soft.c").write_text(c_source("soft", "soft", view.parts), encoding="utf-8")
    rows = grid()
    with torch.no_grad():
        status = model(States.from_table(rows)).status.numpy()
    state = np.column_stack([rows["elongation_mm"] * MM, rows["twist_deg"] * DEG, rows["pressure_kpa"] * KPA])
    out, flags = run(tmp_path / "soft.c", "soft").answers(view.answer, state)
    assert 0 < status.sum() < len(rows)
    np.testing.assert_array_equal(out[:, 2], status)
    np.testing.assert_array_equal((flags & 2) > 0, status == 1)


def network(folder):
    """A network with any weights, as a run."""
    model = build_model("mlp", {}, [])
    table = shown(build_model("linear", {"ka": 900.0, "kb": 0.1, "kc": 2.0}, []), grid())
    model.prepare(Rows.from_table(table))
    model.set_vector(torch.tensor(np.random.default_rng(0).normal(size=62)))
    return freelearn.load(folder_of(folder, model, table, covariance=np.diag([])))


@pytest.mark.nightly
def test_onnx_answers_as_a_network_does(tmp_path):
    pytest.importorskip("onnxruntime")
    found = network(tmp_path / "run").export(tmp_path / "out", "onnx")
    assert found.held
    assert max(found.content["round_trip"]["largest_difference"].values()) < 1e-12


def test_onnx_answers_as_the_model_does_at_many_rows_and_says_where_the_data_end(traced, tmp_path):
    onnxruntime = pytest.importorskip("onnxruntime")
    found = traced.export(tmp_path / "out" / "arm.onnx")
    assert found.held
    assert max(found.content["round_trip"]["largest_difference"].values()) < 1e-12
    session = onnxruntime.InferenceSession(str(found.files[0]))
    rows = traced.table().iloc[:5]
    given = {"elongation": rows["elongation_mm"].to_numpy(copy=True) * MM, "twist": rows["twist_deg"].to_numpy() * DEG,
             "pressure": rows["pressure_kpa"].to_numpy() * KPA}  # fmt: skip
    given["elongation"][4] = 20 * MM
    force, inside = session.run(["force", "inside"], given)
    assert inside.tolist() == [1, 1, 1, 1, 0]
    np.testing.assert_allclose(force[:4], rows["force_pred_n"][:4], rtol=1e-6)


@needs_compiler
def test_onnx_answers_as_a_continuum_that_remembers_does(three, tmp_path):
    pytest.importorskip("onnxruntime")
    _, _, functions, _ = three
    checks = checked(functions, write_onnx(functions, tmp_path, Options("onnx", "left")))
    assert checks.held
    assert list(checks.every) == [f.name for f in functions.every]


def test_a_certificate_says_what_it_was_made_of(three):
    fitted, found, *_ = three
    content = json.loads((found.folder / "export.json").read_text())
    assert content["data"]["license"] == "CC-BY-4.0"
    assert content["domain"]["elongation"]["most"] == pytest.approx(fitted.table()["elongation_mm"].max() * MM)
    assert set(content["files"]) == {"left.c"}
    assert content["versions"]["freelearn"] == freelearn.__version__
    page = (found.folder / "export.html").read_text()
    assert page.count("data:image/png;base64,") == 2
