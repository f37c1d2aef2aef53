"""freelearn.load: a fitted model taken up again, with the standard errors of its loads."""

import numpy as np
import pandas as pd
import pytest
import torch
from small_runs import make_csv, run

import freelearn
from freelearn.common.errors import UserError
from freelearn.data.states import States

COLUMNS = ["elongation_mm", "twist_deg", "pressure_kpa"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("fitted")
    csv = make_csv(place / "table.csv", rows=1200)
    run(place / "run", "train=all", "data=csv", f"data.path={csv}", "effects=[end_clamps]", "figures=false")
    return place / "run"


def test_it_predicts_what_the_run_predicted(folder):
    fitted = freelearn.load(folder)
    table = fitted.table()
    answer = fitted.predict(table)
    np.testing.assert_allclose(answer.loads[:, 0], table["force_pred_n"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(1e3 * answer.loads[:, 1], table["moment_pred_nmm"], rtol=1e-6, atol=1e-9)
    assert answer.status == table["status"].tolist()
    assert set(fitted.parameters) == {"C1", "C2", "end_clamps.clamp_length"}
    assert fitted.covariance.shape == (3, 3)
    np.testing.assert_allclose(fitted.covariance, fitted.covariance.T)
    assert "C1 = " in repr(fitted)


def test_standard_errors_are_those_of_drawn_parameters(folder):
    """By simulation: parameters drawn from their covariance, loads predicted with each."""
    fitted = freelearn.load(folder)
    rows = fitted.table().iloc[::97]
    states = States.from_table(rows)
    answer = fitted.predict(states)
    generator = np.random.default_rng(0)
    # Small steps, so that curvature plays no part.
    drawn = generator.multivariate_normal(np.zeros(3), 1e-4 * fitted.covariance, size=400, method="cholesky")
    values = {name: value.detach() for name, value in fitted.model.values().items()}
    loads = []
    for step in drawn:
        moved = {n: values[n] + float(d) for n, d in zip(fitted.parameters, step, strict=True)}
        with torch.no_grad():
            loads.append(fitted.model(states, values | moved).loads.numpy())
    np.testing.assert_allclose(answer.stderr, 100 * np.std(loads, axis=0), rtol=0.2)


def test_a_table_of_states_needs_no_more_than_the_states(folder):
    fitted = freelearn.load(folder)
    rows = fitted.table().query("sample == 6 and step == 3").reset_index(drop=True)
    short = fitted.predict(rows[["sample", *COLUMNS]])
    np.testing.assert_allclose(short.loads, fitted.predict(rows).loads, rtol=1e-12)
    with pytest.raises(UserError, match="3, 6"):
        fitted.predict(rows[COLUMNS])
    with pytest.raises(UserError, match="no sample 9"):
        fitted.predict(pd.DataFrame({"sample": [9], "elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": 10.0}))
    with pytest.raises(UserError, match="twist_deg"):
        fitted.predict(rows[["sample", "elongation_mm", "pressure_kpa"]])


def test_what_is_no_run_is_said_in_a_sentence(tmp_path):
    with pytest.raises(UserError, match="not the folder of a whole run"):
        freelearn.load(tmp_path)


def test_importing_the_package_loads_nothing_heavy_and_leaves_the_collector_of_garbage_as_it_is():
    import subprocess
    import sys

    code = "import gc, sys; before = gc.get_threshold(); import freelearn; assert gc.get_threshold() == before; "
    code += "print(sorted({'torch', 'pandas', 'lightning'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
