"""A run's result is frozen, and says the same whoever looks on."""

import dataclasses
import io
import json

import numpy as np
import pytest
import torch
from rich.console import Console
from small_runs import make_csv, run

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.fit_and_score import compared
from freelearn.api.tasks.fit_and_score import run as evaluate
from freelearn.api.tasks.train_task import train
from freelearn.data.beds import KINEMATIC
from freelearn.data.error import set_error
from freelearn.data.rows import Rows, loads_of
from freelearn.data.table.measurement_table import read_table
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.records.fit_report import fit_report
from freelearn.records.provenance import Origin, Provenance
from freelearn.records.run_files import report, results

TIMES = {"seconds", "fit_seconds"}


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return make_csv(tmp_path_factory.mktemp("runs") / "table.csv", rows=1200)


def test_results_do_not_depend_on_a_console_or_pictures(table, tmp_path):
    overrides = ["train=all", "data=csv", f"data.path={table}", "split=states", "effects=[twist_offset]", "fits=null"]
    told = io.StringIO()
    train(settings(TrainSettings, [*overrides, "figures=true"]), tmp_path / "seen", console=Console(file=told))
    run(tmp_path / "unseen", *overrides, "figures=false")
    seen, unseen = (
        {k: v for k, v in json.loads((tmp_path / name / "results.json").read_text()).items() if k not in TIMES}
        for name in ("seen", "unseen")
    )
    assert seen == unseen
    assert {"comparison", "noise_floor", "failures", "covariance"} <= set(unseen)
    shown = told.getvalue()
    assert f"{100 * seen['comparison']['all']['without']:.2f}" in shown
    assert f"{100 * seen['noise_floor']:.2f} %" in shown


def test_a_result_cannot_be_changed(table, tmp_path):
    outcome = run(tmp_path, "train=all", "data=csv", f"data.path={table}", "figures=false")
    with pytest.raises(dataclasses.FrozenInstanceError):
        outcome.seconds = 1.0


def test_intervals_of_results_report_and_covariance_agree(table, tmp_path):
    outcome = run(tmp_path, "train=all", "data=csv", f"data.path={table}", "effects=[twist_offset]")
    content = json.loads((tmp_path / "results.json").read_text())
    covariance = np.array(content["covariance"])
    text = (tmp_path / "fit_report.txt").read_text()
    for i, (name, entry) in enumerate(content["parameters"].items()):
        assert covariance[i, i] ** 0.5 == pytest.approx(entry["stderr"])
        assert entry["low"] < entry["value"] < entry["high"]
        assert f"{entry['low']:.6g}" in text
        line = next(line for line in text.splitlines() if line.split()[:1] == [name])
        assert float(line.split()[1]) == pytest.approx(entry["value"], rel=1e-6)
        if name in ("C1", "C2"):
            assert entry["low"] * entry["high"] == pytest.approx(entry["value"] ** 2)
    assert f"{content['freedom']} degrees of freedom" in text
    assert report(outcome) == text


def test_what_nothing_determines_is_null_and_has_no_interval(table):
    measured = read_table(table).table
    outcome = evaluate(build_model("continuum", {}, []), measured, "constituent", "every", None, 0)
    entries = results(outcome, Origin(Provenance("virtual", True, 0), 0, "rows", (0.64, 0.16)))
    unknown = dict.fromkeys(("stderr", "low", "high", "stderr_independent", "interval", "interval_note"))
    assert entries["parameters"]["C1"] == {"value": pytest.approx(5e5), "unit": "Pa"} | unknown
    assert "covariance" not in entries
    assert "(nothing was fitted)" in report(outcome)


def test_an_effect_is_judged_on_rows_that_both_models_answer(table):
    measured = read_table(table).table
    whole, gaps = (evaluate(build_model("continuum", {}, []), measured, "constituent", "all", None, 0) for _ in "ab")
    # The second model cannot answer its worst test rows: scored alone on the rest it would look better.
    off = ((gaps.prediction.loads - loads_of(gaps.table)) ** 2).sum(1)
    status = gaps.prediction.status.clone()
    status[off > off.median()] = Status.NO_EQUILIBRIUM
    gaps = dataclasses.replace(gaps, prediction=gaps.prediction._replace(status=status))
    pair = compared(whole, gaps)["all"]
    assert pair.without == pair.with_effects
    assert 0 < pair.n < whole.errors["all"].n
    test = torch.as_tensor(whole.labels == "test")
    answered = status[test] == Status.OK
    rows = Rows.from_table(whole.table)[test], whole.prediction.loads[test]
    assert pair.without == pytest.approx(set_error(*rows, answered).E)
    assert pair.without < whole.errors["all"].E


def test_a_report_says_what_never_moved(table, tmp_path):
    outcome = run(tmp_path, "train=all", "data=csv", f"data.path={table}", "figures=false")
    assert outcome.uncertainty is not None
    fitted = outcome.model, outcome.uncertainty, outcome.model.vector()
    still = fit_report(*fitted, "none", "", 0, outcome.counts(), KINEMATIC.measured)
    assert "C1 is still where the fit began" in still
