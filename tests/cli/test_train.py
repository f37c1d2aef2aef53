"""`python train.py` as a user runs it: the files of the contract, bad input, reproducibility."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from conftest import ROOT
from nightly import EVERY, usually
from small_runs import make_csv, run
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from freelearn.common.errors import UserError
from freelearn.data.beds import NMM
from freelearn.data.sets import samples_of, set_names, split_rows
from freelearn.data.states import States, kinematic_state
from freelearn.physics.models.build import load_model
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.small_tables import random_table


@pytest.fixture
def csv(tmp_path: Path) -> Path:
    return make_csv(tmp_path / "table.csv", rows=1200)


@pytest.mark.parametrize("model", usually("continuum", nightly=["linear", "mlp"]))
def test_every_file_of_the_contract(model, csv, tmp_path):
    folder = tmp_path / "run"
    outcome = run(folder, f"model={model}", "train=all", "data=csv", f"data.path={csv}", "seed=3", "figures=true")
    results = json.loads((folder / "results.json").read_text())
    assert {"model", "train", "fit", "effects", "seed", "parameters", "tests", "counts", "seconds"} <= set(results)
    assert (results["model"], results["train"], results["seed"]) == (model, "all", 3)
    assert list(results["tests"]) == ["sample3", "sample6", "even", "all"]
    assert all({"value", "stderr", "unit"} <= set(p) for p in results["parameters"].values())

    table = pd.read_csv(folder / "predictions.csv")
    original = pd.read_csv(csv)
    pd.testing.assert_frame_equal(table[original.columns], original, rtol=1e-9, check_dtype=False)
    assert set(table["split"]) == ({"train", "validation", "test"} if model == "mlp" else {"train", "test"})
    # The errors in results.json follow from predictions.csv by the paper's formula.
    scored = table[(table["split"] == "test") & (table["buckled"] == 0)]
    kept = scored[scored["status"] == "ok"]
    force = (kept["force_n"] - kept["force_pred_n"]) / scored["force_n"].abs().max()
    moment = (kept["moment_nmm"] - kept["moment_pred_nmm"]) / scored["moment_nmm"].abs().max()
    assert results["tests"]["all"]["E"] == pytest.approx(np.sqrt((force**2 + moment**2).mean()), rel=1e-6)
    assert results["tests"]["all"]["n"] == len(kept)

    reloaded = load_model(folder / "checkpoint.ckpt")
    assert isinstance(torch.load(folder / "checkpoint.ckpt", weights_only=True), dict)
    with torch.no_grad():
        again = reloaded(States.from_table(original)).loads
    torch.testing.assert_close(again, outcome.prediction.loads)

    report = (folder / "fit_report.txt").read_text()
    for heading in ("[[Fit Statistics]]", "[[Variables]]", "chi-square", "Akaike", "Bayesian", "95 % interval"):
        assert heading in report
    events = EventAccumulator(str(folder), size_guidance={"images": 0})
    events.Reload()
    assert {"parity", "residual_map"} <= set(events.Tags()["images"])
    assert "error_percent/train" in events.Tags()["scalars"]
    assert not list(folder.glob("*.part")) + list(folder.glob(".*.part"))


def test_recovers_the_material_of_noise_free_data(tmp_path):
    csv = make_csv(tmp_path / "clean.csv", rows=1200, noise=0.0)
    outcome = run(tmp_path / "run", "train=sample3", "data=csv", f"data.path={csv}", "model.C1=1e8", "model.C2=1e4")
    assert outcome.model.scalars() == pytest.approx({"C1": 1e6, "C2": 2e7}, rel=1e-6)
    assert outcome.errors["sample6"].E < 1e-6


def test_the_same_seed_gives_the_same_numbers_and_another_another_split(csv, tmp_path):
    options = ("model=mlp", "train=all", "data=csv", f"data.path={csv}", "fit.max_epochs=30")
    first = run(tmp_path / "a", *options, "seed=1")
    second = run(tmp_path / "b", *options, "seed=1")
    other = run(tmp_path / "c", *options, "seed=2")
    assert first.errors == second.errors
    assert (first.labels != other.labels).any()
    numbers = [json.loads((tmp_path / name / "results.json").read_text())["parameters"] for name in "ab"]
    assert numbers[0] == numbers[1]


def test_effects_lower_the_error_of_data_that_have_them(tmp_path, csv):
    table = pd.read_csv(csv)
    model = Continuum(1e6, 2e7)
    from freelearn.physics.effects.registry import make_effects

    slack = Continuum(1e6, 2e7, effects=make_effects(["fiber_tension_only"], "continuum"))
    slack.set_values({"fiber_tension_only.share": 0.7})
    with torch.no_grad():
        loads = slack(States.from_table(table)).loads.numpy()
        assert np.abs(loads - model(States.from_table(table)).loads.numpy()).max() > 0.1
    table["force_n"], table["moment_nmm"] = loads[:, 0], loads[:, 1] / NMM
    table.to_csv(tmp_path / "slack.csv", index=False)
    options = ("train=all", "data=csv", f"data.path={tmp_path / 'slack.csv'}")
    before = run(tmp_path / "a", *options)
    after = run(tmp_path / "b", *options, "effects=[fiber_tension_only]")
    assert before.errors["all"].E > 0.01
    assert after.errors["all"].E < 1e-6
    assert after.model.scalars()["fiber_tension_only.share"] == pytest.approx(0.7, rel=1e-5)


def test_constituent_fits_nothing(csv, tmp_path):
    outcome = run(tmp_path / "run", "train=constituent", "data=csv", f"data.path={csv}", f"figures={EVERY}")
    assert outcome.model.scalars() == pytest.approx({"C1": 5e5, "C2": 1e6})
    assert json.loads((tmp_path / "run/results.json").read_text())["fit"] == "none"


BAD = {
    "missing file": (("data=csv", "data.path=nowhere.csv", "train=all"), "nowhere.csv"),
    "no such training set": (("data=csv", "data.path={csv}", "train=sample5"), "sample5.*sample3, sample6"),
    "unknown set": (("train=sampel3",), "Unknown set"),
    "unknown effect": (("effects=[end_clamp]",), "Did you mean 'end_clamps'"),
    "effect that the model cannot carry": (("model=linear", "effects=[wall_stiffening]"), "cannot join"),
    "effect named twice": (("effects=[end_clamps,end_clamps]",), "twice"),
    "impossible parameter": (("model.C1=-5",), "C1 = -5"),
    "parameter that is no number": (("model.C1=soft",), "model.C1"),
    "seed that is no integer": (("seed=abc",), "seed"),
    "network without a fit": (("model=mlp", "fit=none"), "before a fit"),
    "constituents of the linear model": (("model=linear", "train=constituent"), "constituent"),
    "stiffness not positive definite": (("model=linear", "model.kc=1e6"), "positive definite"),
    "fit option out of range": (("fit.max_epochs=0",), "max_epochs"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_mistake_is_one_clear_error_and_leaves_no_results(case, csv, tmp_path):
    overrides, message = BAD[case]
    folder = tmp_path / "run"
    with pytest.raises(UserError, match=message):
        run(folder, *(o.format(csv=csv) for o in overrides))
    assert not (folder / "results.json").exists()
    assert not (folder / "predictions.csv").exists()


def test_all_rows_buckled_too_few_rows_and_empty_tables(tmp_path):
    buckled = make_csv(tmp_path / "buckled.csv", buckled=1)
    with pytest.raises(UserError, match="buckled"):
        run(tmp_path / "a", "data=csv", f"data.path={buckled}", "train=all")
    few = make_csv(tmp_path / "few.csv", rows=400)
    pd.read_csv(few).head(30).to_csv(few, index=False)
    with pytest.raises(UserError, match="62 parameters"):
        run(tmp_path / "b", "data=csv", f"data.path={few}", "train=all", "model=mlp")


def test_rows_that_are_left_out_are_never_fitted_or_scored_but_counted(csv, tmp_path):
    table = pd.read_csv(csv)
    marked = np.arange(len(table)) % 37 == 5
    loads = ["force_n", "moment_nmm"]
    shown = {}
    for name, columns in {
        "wild": {"left_out": np.where(marked, "1", "")},
        "mild": {"left_out": marked.astype(int)},
        "buckled": {"buckled": marked.astype(int)},
    }.items():
        other = table.assign(**columns)
        if name == "wild":
            other.loc[marked, loads] *= -1000.0
        other.to_csv(tmp_path / f"{name}.csv", index=False)
        outcome = run(
            tmp_path / name,
            "train=all",
            "data=csv",
            f"data.path={tmp_path / name}.csv",
            "effects=[twist_offset]",
        )
        shown[name] = json.loads((tmp_path / name / "results.json").read_text())
        assert (outcome.labels[marked] == "").all()
        assert (outcome.labels[~marked] != "").all()
    for name in ("parameters", "tests", "comparison", "noise_floor", "failures"):
        assert shown["wild"][name] == shown["mild"][name] == shown["buckled"][name]
    for name, buckled, left_out in (("wild", 0, marked.sum()), ("buckled", marked.sum(), 0)):
        counts = shown[name]["counts"]
        assert (counts["rows"], counts["buckled"], counts["left_out"]) == (len(table), buckled, left_out)
    # The column stays in predictions.csv, where other commands look for it.
    predicted = pd.read_csv(tmp_path / "wild" / "predictions.csv")
    assert (predicted["left_out"] == marked).all()
    assert predicted.loc[marked, "split"].isna().all()
    assert "left_out" not in pd.read_csv(tmp_path / "buckled" / "predictions.csv")
    assert re.search(rf"rows left_out +.* {marked.sum()}\n", (tmp_path / "wild" / "fit_report.txt").read_text())


def test_a_set_that_is_left_out_altogether_is_told(csv, tmp_path):
    table = pd.read_csv(csv)
    path = tmp_path / "marked.csv"
    table.assign(left_out=(table["sample"] == 6).astype(int)).to_csv(path, index=False)
    with pytest.raises(UserError, match="'sample6' has no rows to fit, all are buckled or left out"):
        run(tmp_path / "a", "data=csv", f"data.path={path}", "train=sample6", "test=sample3")
    with pytest.raises(UserError, match="'sample6' has no rows to score"):
        run(tmp_path / "b", "data=csv", f"data.path={path}", "train=sample3", "test=sample6")


def test_every_set_means_those_that_have_test_rows(csv, tmp_path):
    table = pd.read_csv(csv)
    first = table[table["sample"] == 6].iloc[0]
    one = (table["elongation_mm"] == first["elongation_mm"]) & (table["twist_deg"] == first["twist_deg"])
    path = tmp_path / "few.csv"
    table[(table["sample"] != 6) | one].to_csv(path, index=False)
    given = "data=csv", f"data.path={path}"
    errors = run(tmp_path / "a", *given, "train=all", "split=states", "fit=none").errors
    assert "sample6" not in errors
    assert {"sample3", "all"} <= set(errors)
    # The set that is trained on, or that is asked for, must be tested.
    wanted = "'sample6' has no rows to score: all its kinematic states are trained on: use split=rows"
    with pytest.raises(UserError, match=wanted):
        run(tmp_path / "b", *given, "train=sample6", "split=states", "fit=none")
    with pytest.raises(UserError, match=wanted):
        run(tmp_path / "c", *given, "train=sample3", "test=sample6", "split=states", "fit=none")
    # By rows it can, with effects too; these are then not compared.
    run(tmp_path / "d", *given, "train=sample6", "effects=[force_offset]")
    told = json.loads((tmp_path / "d" / "results.json").read_text())
    assert "comparison" not in told
    assert "not compared: no kinematic state can be held out" in " ".join(told["notes"])


@pytest.mark.slow
def test_the_command_itself(csv, commands, tmp_path):
    asked = ["fits=null", "figures=false", "train=sample3", "data=csv", f"data.path={csv}"]
    line = [sys.executable, "train.py", *asked, f"hydra.run.dir={tmp_path / 'good'}"]
    good = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert good.returncode == 0, good.stderr
    assert "C1" in good.stdout
    assert str(tmp_path / "good") in good.stdout
    for overrides in (("model=contnuum",), ("train=nothing",), ("no_such_key=1",), ("data=csv",)):
        bad = commands.run("train", "fits=null", *overrides, f"hydra.run.dir={tmp_path / 'bad'}")
        assert bad.status != 0
        assert "Traceback" not in bad.told, overrides
        assert len(bad.err.strip()) > 20


@pytest.mark.slow
def test_an_output_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(UserError, match="Cannot write"):
        run(tmp_path / "file" / "run")


@pytest.mark.slow
def test_an_interrupted_run_leaves_no_results(commands, tmp_path):
    folder = tmp_path / "run"
    process = commands.start("train", "model=mlp", "fit=adam", "fit.max_epochs=100000", f"hydra.run.dir={folder}")
    deadline = time.time() + 120
    while not list(folder.glob("events*")) and time.time() < deadline:
        time.sleep(0.1)
    time.sleep(1)
    os.kill(process, signal.SIGINT)
    ended = commands.wait(process)
    assert ended.status != 0
    assert "interrupted" in ended.err
    assert "Traceback" not in ended.err
    assert not (folder / "results.json").exists()


def test_real_measurements_run_through(shared_data, tmp_path):
    path = shared_data / "free70_single/measurements.csv"
    outcome = run(tmp_path / "run", "model=linear", "train=all", "data=csv", f"data.path={path}", f"figures={EVERY}")
    assert outcome.errors["all"].n == 74
    # The measured force is a fifth of what the pressure on the bore must give: the fluid term alone overshoots.
    assert outcome.errors["all"].E > 1


def test_splits_keep_their_shares_and_whole_states():
    table = pd.concat([random_table(1, s).assign(step=i) for s in range(200) for i in range(5)], ignore_index=True)
    table["pressure_kpa"] = np.arange(len(table)) % 5 * 10.0
    table["sample"] = 3
    for by_states in (False, True):
        labels = split_rows(table, 0, by_states)
        shares = pd.Series(labels).value_counts(normalize=True)
        assert shares.to_dict() == pytest.approx({"train": 0.64, "validation": 0.16, "test": 0.20}, abs=0.005)
    by_state = pd.Series(labels).groupby(kinematic_state(table)).nunique()
    assert (by_state == 1).all()
    # A sample's split does not depend on what else the table holds.
    more = pd.concat([table.assign(sample=1), table], ignore_index=True)
    np.testing.assert_array_equal(split_rows(more, 0, False)[len(table) :], split_rows(table, 0, False))


def test_sets_by_name():
    available = np.array([1, 2, 3, 4, 4])
    assert samples_of("even", available).tolist() == [2, 4]
    assert samples_of("all", available).tolist() == [1, 2, 3, 4]
    assert set_names(available) == ["sample1", "sample2", "sample3", "sample4", "even", "all"]
    assert set_names(np.array([70, 70])) == ["sample70", "all"]


def test_an_accuracy_to_be_estimated_still_gives_a_noise_floor_and_failures(csv, tmp_path):
    run(tmp_path / "run", "train=all", "data=csv", f"data.path={csv}", "data.accuracy=estimate")
    content = json.loads((tmp_path / "run" / "results.json").read_text())
    # The table's noise is 2 % of each load, which E counts by the largest: between nothing and that.
    assert 0.001 < content["noise_floor"] < 0.03
    assert content["failures"]
    assert content["notes"][0].startswith("accuracy estimated from how neighbors along the pressure differ: ")


def test_several_samples_are_a_set_with_an_error_of_its_own(csv, tmp_path):
    listed = run(tmp_path / "a", "train=[sample3,sample6]", "data=csv", f"data.path={csv}")
    everything = run(tmp_path / "b", "train=all", "data=csv", f"data.path={csv}")
    assert listed.train == "sample3+sample6"
    assert listed.errors["sample3+sample6"] == listed.errors["all"]
    assert listed.model.scalars() == everything.model.scalars()
    with pytest.raises(UserError, match="sample5"):
        run(tmp_path / "c", "train=[sample3,sample5]", "data=csv", f"data.path={csv}")


def test_other_shares_of_the_rows(csv, tmp_path):
    outcome = run(
        tmp_path / "run", "model=mlp", "train=all", "data=csv", f"data.path={csv}", "split.train=0.4",
        "split.validation=0.1", "fit.max_epochs=2",
    )  # fmt: skip
    shares = pd.Series(outcome.labels).value_counts(normalize=True).to_dict()
    assert shares == pytest.approx({"train": 0.4, "validation": 0.1, "test": 0.5}, abs=0.01)


def test_mistakes_in_names_are_told_together(csv, tmp_path):
    with pytest.raises(UserError) as told:
        run(tmp_path / "run", "data=csv", f"data.path={csv}", "train=sample5", "test=sample7")
    assert all(name in str(told.value) for name in ("sample5", "sample7"))
    with pytest.raises(UserError) as told:
        run(tmp_path / "run", "effects=[end_clamp]", f"constituent={tmp_path / 'nothing.json'}")
    assert all(name in str(told.value) for name in ("end_clamps", "nothing.json"))


def test_a_device_that_is_not_there_is_told(tmp_path):
    if torch.cuda.is_available():
        pytest.skip("this machine has a CUDA device")
    with pytest.raises(UserError, match="device=cuda"):
        run(tmp_path / "run", "device=cuda")


def test_a_drift_without_times_says_what_it_assumes(csv, tmp_path):
    run(tmp_path / "run", "train=all", "data=csv", f"data.path={csv}", "effects=[sensor_drift]")
    notes = json.loads((tmp_path / "run" / "results.json").read_text())["notes"]
    assert any("no time_s" in note and "20 s" in note for note in notes)


def test_constants_of_an_effect_that_the_model_lacks_say_what_to_add(csv, tmp_path):
    def entry(value: float, unit: str) -> dict:
        return {"value": value, "stderr": None, "unit": unit}

    specimen = {
        "effects": ["wall_stiffening"],
        "parameters": {"C1": entry(4e5, "Pa"), "wall_stiffening.C20": entry(1e4, "Pa")},
        "modes": {},
    }
    (tmp_path / "specimen.json").write_text(json.dumps(specimen))
    options = ("train=constituent", "data=csv", f"data.path={csv}", f"constituent={tmp_path / 'specimen.json'}")
    with pytest.raises(UserError, match=r"add effects=\[wall_stiffening\]"):
        run(tmp_path / "a", *options)
    outcome = run(tmp_path / "b", *options, "effects=[wall_stiffening]")
    assert outcome.model.scalars()["wall_stiffening.C20"] == pytest.approx(1e4)
