"""What TensorBoard shows of one run: hyperparameters to compare runs by, and the run in words."""

import json
import re
import statistics

import pytest
from small_runs import make_csv, run
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.custom_scalar.layout_pb2 import Layout
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    """A single run's results.json and its events."""
    folder = tmp_path_factory.mktemp("tensorboard")
    csv = make_csv(folder / "table.csv", rows=400)
    own = ("model=linear", "train=sample3", "split=states", "seed=4", "figures=false")
    run(folder / "run", *own, "data=csv", f"data.path={csv}")
    (path,) = (folder / "run").glob("events.out.tfevents.*")
    events = EventAccumulator(str(path))
    events.Reload()
    return json.loads((folder / "run/results.json").read_text()), events


def test_hyperparameters_hold_what_runs_differ_by(single):
    _, events = single
    start = events.PluginTagToContent("hparams")["_hparams_/session_start_info"]
    known = HParamsPluginData.FromString(start).session_start_info.hparams
    assert known["seed"].number_value == 4
    words = {name: known[name].string_value for name in ("model", "train", "effects", "fit")}
    fit = "levenberg_marquardt, split by states"
    assert words == {"model": "linear", "train": "sample3", "effects": "none", "fit": fit}
    # TensorBoard's table shows so many at first.
    assert len(known) <= 5


def test_errors_of_its_own_set_of_unseen_samples_and_the_median_are_there(single):
    results, events = single
    errors = {name: scores["E"] for name, scores in results["tests"].items()}
    # Sample 3 is in "all", and odd.
    unseen = [errors[name] for name in errors if name not in ("sample3", "all")]
    wanted = {"own": errors["sample3"], "unseen": statistics.mean(unseen), "median": statistics.median(errors.values())}
    for name, value in wanted.items():
        assert events.Scalars(f"error_percent/{name}")[-1].value == pytest.approx(100 * value, rel=1e-5)
    experiment = events.PluginTagToContent("hparams")["_hparams_/experiment"]
    metrics = {info.name.tag for info in HParamsPluginData.FromString(experiment).experiment.metric_infos}
    assert {"error_percent/own", "error_percent/unseen", "error_percent/median"} <= metrics


def test_the_layout_of_custom_scalars_finds_what_the_run_logged(single):
    _, events = single
    (shown,) = events.Tensors("custom_scalars__config__")
    layout = Layout.FromString(shown.tensor_proto.string_val[0])
    patterns = [tag for part in layout.category for chart in part.chart for tag in chart.multiline.tag]
    scalars = events.Tags()["scalars"]
    # A fit by least squares has no validation.
    assert [p for p in patterns if not any(re.fullmatch(p, tag) for tag in scalars)] == ["error_percent/validation"]


def test_the_run_is_told_in_words(single):
    results, events = single
    story = events.Tensors("story/text_summary")[0].tensor_proto.string_val[0].decode()
    assert story.startswith("Model linear, fitted on sample3 by levenberg\\_marquardt; seed 4, split by states.")
    own = f"{100 * results['tests']['sample3']['E']:.2f}"
    assert re.search(rf"^\| sample3[^|]* \| {own} \|", story, re.MULTILINE)
    assert all(f"| {name} |" in story for name in results["parameters"])
