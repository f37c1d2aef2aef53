"""fit.intervals=profile, from the command line to results.json, fit_report.txt, the page and the terminal."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from small_runs import make_csv, run

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.api.tasks.train_task import train
from freelearn.common.errors import UserError
from freelearn.fitting.uncertainty import Uncertainty
from freelearn.physics.models.build import build_model
from freelearn.records.estimates import Estimate, effect_notes, interval_notes, intervals_caption, parameter_table
from freelearn.records.sweep_records import read_records
from freelearn.report.terminal.long_work import ProfileProgress

PROFILE = "fit.intervals=profile"


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return make_csv(tmp_path_factory.mktemp("profiles") / "table.csv")


def ran(folder, table, *overrides, console=None):
    chosen = ["train=all", "data=csv", f"data.path={table}", "figures=false", "effects=[end_clamps]", *overrides]
    train(settings(TrainSettings, chosen), folder, console=console)
    return json.loads((folder / "results.json").read_text()), (folder / "fit_report.txt").read_text()


def test_they_stand_in_every_file_and_only_the_intervals_change(table, tmp_path):
    told = io.StringIO()
    normal, report = ran(tmp_path / "normal", table, "fits=null")
    profile, profiled = ran(tmp_path / "profile", table, "fits=null", PROFILE, console=Console(file=told, width=200))
    ends = {"low", "high", "interval", "interval_note"}
    for name, entry in profile["parameters"].items():
        other = normal["parameters"][name]
        assert (other["interval"], other["interval_note"]) == ("normal", None)
        assert entry["interval"] == "profile"
        assert entry["low"] <= entry["value"] <= entry["high"]
        assert {k: v for k, v in entry.items() if k not in ends} == {k: v for k, v in other.items() if k not in ends}
        line = next(line for line in profiled.splitlines() if line.split()[:1] == [name])
        assert f"{entry['high']:.6g}" in line
    assert profile["tests"] == normal["tests"]
    assert profile["comparison"] == normal["comparison"]
    assert profile["covariance"] == normal["covariance"]
    # The held length cannot be negative; the normal interval does not know.
    clamp = profile["parameters"]["end_clamps.clamp_length"]
    assert normal["parameters"]["end_clamps.clamp_length"]["low"] < clamp["low"] == 0
    assert clamp["interval_note"] == "its interval ends at the bound 0 m"
    caption, note = "95 % intervals: profile likelihood", "end_clamps.clamp_length: its interval ends at the bound 0 m."
    assert caption not in report
    page = (tmp_path / "profile" / "report.html").read_text()
    for text in (profiled, page, told.getvalue()):
        assert caption in text
        assert note in text
    assert f"Student's t with {profile['freedom']} degrees of freedom" in profiled
    estimates = {e.name: e for e in read_records(tmp_path / "profile")[0].estimates}
    assert estimates["end_clamps.clamp_length"].note == clamp["interval_note"]
    assert estimates["C1"].kind == "profile"


@pytest.mark.nightly
def test_fits_and_profiles_are_kept_apart_and_found_again(table, tmp_path):
    kept = f"fits={tmp_path / 'fits'}"
    first, _ = ran(tmp_path / "first", table, kept)
    second, _ = ran(tmp_path / "second", table, kept, PROFILE)
    third, report = ran(tmp_path / "third", table, kept, PROFILE)
    fourth, _ = ran(tmp_path / "fourth", table, kept)
    # The profiles needed no new fit, and nor did anything after them.
    assert [r["fit_reused"] for r in (first, second, third, fourth)] == [False, True, True, True]
    assert third["parameters"] == second["parameters"]
    assert fourth["parameters"] == first["parameters"] != second["parameters"]
    assert "its interval ends at the bound 0 m" in report
    assert {r["fit_seconds"] for r in (second, third, fourth)} == {first["fit_seconds"]}


def test_without_a_fit_there_are_no_intervals_to_ask_for(table, tmp_path):
    for overrides in (["fit=none"], ["train=constituent"]):
        content, report = ran(tmp_path / overrides[0], table, PROFILE, "effects=[]", *overrides)
        assert content["parameters"]["C1"]["interval"] is None
        assert content["parameters"]["C1"]["low"] is None
        assert "nothing was fitted" in report


def test_of_a_network_the_report_says_why_they_are_normal(tmp_path):
    table = make_csv(tmp_path / "table.csv", rows=1200)
    outcome = run(
        tmp_path, "model=mlp", "train=all", "data=csv", f"data.path={table}", "figures=false", PROFILE,
        "fit.max_epochs=3", "fit.restarts=1",
    )  # fmt: skip
    said = "Profile intervals are for physical parameters"
    assert said in (tmp_path / "fit_report.txt").read_text()
    assert said in (tmp_path / "report.html").read_text()
    assert {estimate.kind for estimate in outcome.estimates()} == {"normal"}


@pytest.mark.parametrize("kind", [TrainSettings, DiscoverSettings])
@pytest.mark.parametrize("fit", ["levenberg_marquardt", "adam"])
def test_another_kind_is_refused_in_words(kind, fit):
    with pytest.raises(UserError, match=r"fit\.intervals = 'bayes' is not possible: choose 'normal' or 'profile'"):
        settings(kind, [f"fit={fit}", "fit.intervals=bayes"])


def test_a_search_has_none(table, tmp_path):
    chosen = settings(DiscoverSettings, ["train=all", "data=csv", f"data.path={table}", PROFILE])
    with pytest.raises(UserError, match=r"fit\.intervals=profile belongs to train\.py"):
        discover(chosen, tmp_path / "search", Console(file=io.StringIO()))


def test_progress_is_shown_where_somebody_looks_on():
    for terminal in (True, False):
        shown = io.StringIO()
        with ProfileProgress(Console(file=shown, force_terminal=terminal)) as told:
            assert not shown.getvalue()
            told("C1", 0, 4)
            told("C2", 2, 4)
        assert ("C2: 2 of 4 ends" in shown.getvalue()) is terminal
    with ProfileProgress(None) as told:
        told("C1", 0, 4)


def known(**changes) -> Uncertainty:
    """Two parameters, the first an effect's with an interval about nothing."""
    plain = {
        "names": ["twist_offset.angle", "C1"], "values": np.array([0.1, 2.0]), "stderr": np.array([0.01, np.nan]),
        "stderr_independent": np.array([0.01, np.nan]), "low": np.array([-0.1, 1.0]), "high": np.array([0.3, np.inf]),
        "freedom": 10, "covariance": np.full((2, 2), np.nan), "chi_square": 1.0, "residuals": 20, "rows": 10,
        "kinds": ["profile", "profile"], "words": ["", "only a lower limit is known: above 1 Pa"],
    }  # fmt: skip
    return Uncertainty(**plain | changes)


def test_whether_an_effect_is_needed_is_read_from_its_profile():
    model = build_model("continuum", {}, ["twist_offset"])
    model.declared.pop("C2")
    said = "twist_offset.angle is not significantly different from no effect"
    assert any(note.startswith(said) for note in effect_notes(model, known()))
    assert not any(note.startswith(said) for note in effect_notes(model, known(kinds=["normal", "normal"])))
    assert interval_notes(known(remark="All.")) == ["All.", "C1: only a lower limit is known: above 1 Pa."]


def test_what_the_rows_do_not_determine_is_said_and_has_no_digits():
    model = build_model("continuum", {}, ["twist_offset"])
    model.declared.pop("C2")
    lost = known(values=np.array([0.1, 2.2e17]), stderr=np.array([0.5, 5.8e40]), kinds=["normal", "normal"])
    said = effect_notes(model, lost)
    assert said[0] == "C1 = 2.2e+17 Pa is not determined by these rows: its standard error is 2.6e+23 times as large."
    # An angle about zero may have a larger error than itself.
    assert not any("determined" in note for note in said[1:])
    entry = Estimate("C1", 2.2e17, "Pa", 5.8e40, 0.0, np.inf, kind="normal")
    table = parameter_table([entry, Estimate("twist_offset.angle", 0.1, "rad", 5.0, -10, 10, kind="normal")])
    assert table.rows[0][1:5] == ("2.2e+17", "–", "–", "–")
    assert "–" not in table.rows[1]
    assert table.caption == "not determined by these rows: C1"


def test_of_few_rows_an_interval_over_decades_is_no_interval():
    """Among a handful of rows a standard error of the value's own size already says nothing."""
    few = Estimate("C2", 51076.0, "Pa", 9.2e4, 5.6e-6, 4.6e14, kind="normal")
    assert parameter_table([few]).rows[0][1:5] == ("5.1e+04", "–", "–", "–")
    # Wide, and still something: a factor of sixty.
    assert not Estimate("C2", 8.1e8, "Pa", 2.6e8, 1.4e7, 4.8e10, kind="normal").untold
    model = build_model("continuum", {}, ["twist_offset"])
    model.declared.pop("C2")
    lost = known(values=np.array([0.1, 5e4]), stderr=np.array([0.5, 9e4]), high=np.array([1.0, 4.6e14]))
    said = effect_notes(model, replace(lost, kinds=["normal", "normal"]))
    assert (
        said[0] == "C1 = 5e+04 Pa is not determined by these rows: they are too few for its standard error of 9e+04 Pa."
    )


def test_open_ends_are_dashes_and_nulls():
    estimate = Estimate("C1", 2.0, "Pa", low=1.0, high=float("inf"), kind="profile", note="only a lower limit")
    assert parameter_table([estimate]).rows[0][4] == "–"
    assert estimate.plain()["high"] is None
    assert estimate.plain()["interval_note"] == "only a lower limit"
    mixed = [estimate, Estimate("C2", 1.0, "Pa", kind="normal")]
    assert intervals_caption(mixed) == "95 % intervals: profile likelihood; of C2: normal"
    assert intervals_caption(mixed[1:]) == ""
