"""`python discover.py` from a table to a verdict, on data of the benchmark's bed: other code, other quadrature."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from html import unescape
from itertools import count
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from hidden_tables import FEW, MATERIAL, NOISE, QUICK, among, table
from nightly import EVERY, usually
from rich.console import Console

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks import discover_task as module
from freelearn.api.tasks.discover_task import discover
from freelearn.common.errors import UserError
from freelearn.common.formats import true_minus
from freelearn.discovery.fits import journal
from freelearn.discovery.residuals.suspects import Suspect
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import load_model
from freelearn.testing.reference.truths import outside

FRICTION = {"friction_hysteresis": {"force": 0.6, "moment": 0.02}}
# Where the question is what becomes of a search, whatever it looks at.
THREE = among("friction_hysteresis", "force_offset", "wall_stiffening")
CONTRACT = {
    *("verdict", "effects", "classes", "error", "trail", "candidates", "failures", "proposals", "next_experiment"),
    *("models", "shares", "referee"),
}


def run(table, folder, *overrides, watch=None):
    folder.mkdir(exist_ok=True)
    path = folder / "table.csv"
    table.to_csv(path, index=False)
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false", *overrides])
    with open(folder / "terminal.txt", "w") as file:
        discover(asked, folder, Console(file=file, width=100), watch=watch)
    return json.loads((folder / "discovery.json").read_text())


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A search's folder, what it wrote, and what it found."""
    folder, findings = tmp_path_factory.mktemp("friction"), []

    def kept(*asked):
        findings.append(search(*asked))
        return findings[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "search", kept)
        written = run(table(FRICTION), folder)
    return folder, written, findings[-1]


@pytest.fixture(scope="module")
def friction(searched):
    return searched[:2]


def test_a_hidden_effect_is_named_and_the_error_falls_to_the_noise_floor(friction):
    folder, found = friction
    assert set(found) >= CONTRACT
    assert found["verdict"] == "named"
    assert found["effects"] == ["friction_hysteresis"]
    assert found["classes"] == [["friction_hysteresis"]]
    # At 90 σ nothing else comes near.
    assert [model["effects"] for model in found["models"]] == [["friction_hysteresis"]]
    (model,) = found["models"]
    assert set(model) == {"effects", "E_heldout", "evidence", "parameters", "probability"}
    assert model["E_heldout"] == found["error"]["after"]
    assert min(model["probability"], found["shares"]["friction_hysteresis"]) > 0.99
    error = found["error"]
    assert error["before"] > 2 * error["after"]
    assert 0.8 * error["noise_floor"] < error["after"] < 1.1 * error["noise_floor"]
    assert [entry["effect"] for entry in found["trail"]] == [None, "friction_hysteresis"]
    # In standard deviations as measured a whole model's held-out residuals are 1: 3,400 of them, to 0.012, and a fit.
    before, after = (entry["sigmas_heldout"] for entry in found["trail"])
    assert after == pytest.approx(1, abs=0.05)
    assert before > 2 * after
    values = load_model(folder / "checkpoint.ckpt").scalars()
    for n in (3, 6):
        assert values[f"friction_hysteresis.force[{n}]"] == pytest.approx(0.6, abs=0.02)
        assert values[f"friction_hysteresis.moment[{n}]"] == pytest.approx(0.02, abs=5e-4)
    assert (values["C1"], values["C2"]) == pytest.approx(MATERIAL, rel=0.02)


def test_the_candidates_are_ranked_with_reasons(friction):
    _, found = friction
    first = [c for c in found["candidates"] if c["step"] == 0]
    assert {c["status"] for c in first} <= {"tested", "not_testable", "failed"}
    tested = [c for c in first if c["status"] == "tested"]
    assert max(tested, key=lambda c: c["score"])["effect"] == "friction_hysteresis"
    assert all(0 <= c["p_value"] <= 1 for c in tested)
    assert all(c["reason"] and c["p_value"] is None for c in first if c["status"] != "tested")
    screens = {s["name"]: s["says"] for s in found["screens"]}
    assert "friction_hysteresis" in screens["rising against falling pressure"]


def test_where_the_model_fails_is_told_by_direction(friction):
    _, found = friction
    worst = found["failures"][0]
    assert "pressure is" in worst["where"]
    assert worst["share_of_squared_error"] == max(f["share_of_squared_error"] for f in found["failures"])
    assert 0 < sum(f["share_of_squared_error"] for f in found["failures"]) <= 1 + 1e-9


def test_terminal_and_files_say_the_same(friction):
    folder, found = friction
    text = (folder / "terminal.txt").read_text()
    assert "Named: friction_hysteresis was missing" in text
    assert f"{100 * found['error']['after']:.3f}" in text
    for when, size in (("before", found["error"]["before"]), ("after", found["error"]["after"])):
        rows = pd.read_csv(folder / f"predictions_{when}.csv")
        scaled = [
            (rows[f"{load}_pred_{unit}"] - rows[f"{load}_{unit}"]) / rows[f"{load}_{unit}"].abs().max()
            for load, unit in (("force", "n"), ("moment", "nmm"))
        ]
        # Fitted on all rows, so a little below the error on held-out states.
        assert np.sqrt((scaled[0] ** 2 + scaled[1] ** 2).mean()) == pytest.approx(size, rel=0.05)
    assert found["says"] in (folder / "report.html").read_text()


def test_the_referees_checks_stand_in_a_file_and_in_every_form(friction):
    folder, found = friction
    referee = json.loads((folder / "referee.json").read_text())
    assert (referee["claimed"], referee["verdict"], referee["checks"]) == ("named", "named", found["referee"])
    assert {check["result"] for check in referee["checks"]} <= {"pass", "fail", "cannot_tell"}
    assert not [c for c in referee["checks"] if c["decides"] and c["result"] != "pass"]
    text, page = (folder / "terminal.txt").read_text(), unescape((folder / "report.html").read_text())
    for check in referee["checks"]:
        assert set(check) >= {"name", "result", "figure", "threshold", "says"}
        assert check["name"] in text
        assert check["name"] in page
        assert true_minus(check["says"]) in page
    for heading in ("Does the claim stand", "Sets of effects that fit as well as the best", "How probable each effect"):
        assert heading in text
        assert heading in page


def test_nothing_is_named_where_nothing_is_missing(tmp_path):
    found = run(table({}, share=0.1), tmp_path)
    assert (found["verdict"], found["effects"], found["classes"]) == ("adequate", [], [])
    assert len(found["trail"]) == 1
    assert found["error"]["before"] == found["error"]["after"] < 1.1 * found["error"]["noise_floor"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("size", "expected"), [(3e4, {"wall_stiffening", "limited_extensibility"}), (1.5e5, {"wall_stiffening"})]
)
def test_twins_are_a_class_until_the_data_tell_them_apart(size, expected, tmp_path):
    # Gent's and Yeoh's walls differ by a higher power of I₁ − 3: at 30 σ that is nothing, at 150 σ it shows.
    others = "wall_stiffening", "limited_extensibility", "end_clamps", "force_offset"
    found = run(table({"wall_stiffening": {"C20": size}}), tmp_path, among(*others))
    assert found["verdict"] == ("class" if len(expected) > 1 else "named")
    assert set(found["classes"][0]) == expected


@pytest.mark.nightly
def test_states_that_would_split_a_class_are_within_reach(tmp_path):
    data = table({"force_gain": {"gain": 0.03}}, share=0.1)
    found = run(data, tmp_path, among("force_gain", "pressure_gain", "wall_stiffening", "force_offset"))
    if found["verdict"] == "class":
        alike = next(c for c in found["classes"] if len(c) > 1)
        assert found["next_experiment"]
        for state in found["next_experiment"]:
            assert set(state["separates"]) <= set(alike)
            assert data["elongation_mm"].min() <= state["elongation_mm"] <= data["elongation_mm"].max()
            assert data["twist_deg"].min() <= state["twist_deg"] <= data["twist_deg"].max()
            assert state["expected_z"] > 0
    assert any("force_gain" in c for c in found["classes"])


def tangled(s, loads):
    """What depends on three inputs at once, and so on no form that a search writes."""
    # So slowly that few states tell it from noise.
    x, y, p = 0.7 * (s["length"] - s["reference"]) / 2e-3, 3.5 * s["twist"], s["pressure"] / 7e4
    wave = np.sin(x + y) * np.cos(3 * p * x) * np.sin(2 * y * p + 1)
    return loads + np.stack([5.0 * wave, 0 * wave], axis=1)


@pytest.mark.nightly
def test_what_no_form_holds_is_unexplained(tmp_path):
    found = run(table({}, extra=tangled, samples=(3,), share=0.15), tmp_path, QUICK)
    assert found["verdict"] == "unexplained"
    # By the search itself, before the referee has refuted anything.
    assert json.loads((tmp_path / "referee.json").read_text())["claimed"] == "unexplained"
    assert found["proposals"] == []
    assert found["remainder"]["hint"]


@pytest.mark.nightly
def test_what_the_library_does_not_hold_is_written(tmp_path):
    found = run(table({}, extra=outside("cogging", 8.0), samples=(3,)), tmp_path, QUICK)
    assert found["verdict"] == "proposed"
    assert found["remainder"] is None
    (written,) = found["proposals"]
    assert (tmp_path / written["file"]).is_file()


@pytest.fixture
def ticking(monkeypatch):
    """The journal's clock goes on with each fit, however long that takes: what was made is kept every few fits."""
    ticks = count(0.0, 0.4 * journal.SECONDS)
    monkeypatch.setattr(journal, "time", SimpleNamespace(monotonic=lambda: next(ticks)))


@pytest.mark.usefixtures("ticking")
def test_interrupted_it_goes_on_where_it_was_and_ends_the_same_to_the_last_digit(tmp_path, monkeypatch):
    add, made, most = journal.Journal.add, [], [math.inf]

    def counted(self, asked, ending):
        if len(made) == most[0]:
            raise KeyboardInterrupt
        made.append(asked)
        add(self, asked, ending)

    monkeypatch.setattr(journal.Journal, "add", counted)
    two = table(FRICTION | {"force_offset": {"force": 1.0}}, samples=(3,), share=0.1)
    whole = run(two, tmp_path / "whole", THREE)
    fits = len(made)
    made.clear()
    most[0] = fits // 2
    with pytest.raises(KeyboardInterrupt):
        run(two, tmp_path / "stopped", THREE)
    assert not (tmp_path / "stopped" / "discovery.json").exists()
    kept = len(json.loads((tmp_path / "stopped" / "progress.json").read_text())["fits"])
    assert 3 < kept <= fits // 2
    most[0] = math.inf
    made.clear()
    found = run(two, tmp_path / "stopped", THREE)
    assert len(made) == fits - kept
    assert not (tmp_path / "stopped" / "progress.json").exists()
    # All but where the table lies, and what follows from that.
    assert {name for name in whole if found[name] != whole[name]} == {"data", "key", "digest"}
    assert set(found["effects"]) == {"friction_hysteresis", "force_offset"}


@pytest.mark.nightly
@pytest.mark.usefixtures("ticking")
def test_another_question_in_the_folder_of_an_interrupted_search_begins_anew(tmp_path):
    def stop(step, text):
        raise KeyboardInterrupt

    one, other = (table(FRICTION | more, samples=(3,), share=0.1) for more in ({"force_offset": {"force": 1.0}}, {}))
    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        run(one, folder, THREE, watch=stop)
    assert (folder / "progress.json").exists()
    assert run(other, folder, THREE)["trail"] == run(other, tmp_path / "whole", THREE)["trail"]


@pytest.mark.nightly
def test_neither_the_order_of_states_nor_the_seed_changes_the_verdict(friction, tmp_path):
    _, found = friction
    data = table(FRICTION)
    blocks = [block for _, block in data.groupby(np.arange(len(data)) // 10)]
    order = np.random.default_rng(1).permutation(len(blocks))
    shuffled = pd.concat([blocks[k] for k in order], ignore_index=True).sort_values("sample", kind="stable")
    shuffled = shuffled.drop(columns="time_s")
    for name, (rows, seed) in {"shuffled": (shuffled, "seed=0"), "seed": (data, "seed=7")}.items():
        other = run(rows, tmp_path / name, seed)
        assert (other["verdict"], other["effects"], other["classes"]) == (
            found["verdict"],
            found["effects"],
            found["classes"],
        )
        assert other["error"]["after"] == pytest.approx(found["error"]["after"], rel=0.03)


@pytest.mark.nightly
@pytest.mark.parametrize("factor", [1 / 3, 3])
def test_wrong_accuracy_is_noticed(factor, tmp_path):
    stated = [f"data.accuracy.{name}={value * factor}" for name, value in NOISE.items()]
    found = run(table(FRICTION, samples=(3,)), tmp_path, QUICK, *stated)
    size = "larger" if factor < 1 else "smaller"
    assert any(f"times {size} than data.accuracy says" in note for note in found["notes"])
    assert found["effects"] == ["friction_hysteresis"]


@pytest.mark.nightly
def test_accuracy_can_be_estimated(tmp_path):
    found = run(table(FRICTION, samples=(3,)), tmp_path, QUICK, "data.accuracy=estimate")
    assert found["effects"] == ["friction_hysteresis"]
    # Within a factor of two of the truth, SI.
    assert 0.5 < found["accuracy"]["force"] / 0.03 < 2
    assert 0.5 < found["accuracy"]["moment"] / 6e-4 < 2


def test_what_the_table_lacks_is_not_testable(tmp_path):
    data = table(FRICTION, samples=(3,), share=0.1).drop(columns="time_s")
    found = run(data, tmp_path, among(*FEW, "relaxation", "sensor_drift"))
    status = {c["effect"]: (c["status"], c["reason"]) for c in found["candidates"] if c["step"] == 0}
    assert status["relaxation"][0] == "not_testable"
    assert "time_s" in status["relaxation"][1]
    # Its rates are per second all the same: what was assumed is told.
    assert status["sensor_drift"][0] == "tested"
    assert any("sensor_drift" in note and "20 s" in note for note in found["notes"])


@pytest.mark.nightly
def test_given_effects_are_part_of_the_question(tmp_path):
    # The page's tick-and-search-again. There is no offset of the force: searched for, it would be taken out again.
    found = run(table(FRICTION, share=0.2), tmp_path, QUICK, "effects=[force_offset]")
    assert (found["verdict"], found["effects"]) == ("named", ["friction_hysteresis"])
    assert found["classes"] == [["friction_hysteresis"]]
    assert "force_offset" not in found["says"]
    assert found["given_effects"] == ["force_offset"]
    assert [entry["effects"] for entry in found["trail"]] == [
        ["force_offset"],
        ["force_offset", "friction_hysteresis"],
    ]
    assert "force_offset" not in {c["effect"] for c in found["candidates"]}
    values = load_model(tmp_path / "checkpoint.ckpt").scalars()
    # Of each sample its own.
    offsets = [value for name, value in values.items() if name.startswith("force_offset.force[")]
    assert offsets == pytest.approx([0.0, 0.0], abs=0.1)


@pytest.mark.nightly
def test_what_the_rows_cannot_show_is_not_added(tmp_path):
    # A gauge that is off looks like friction to rows of which none falls.
    data = table({"pressure_offset": {"pressure": 1.5e3}}, share=0.2)
    found = run(data[data["step"] < 8].reset_index(drop=True), tmp_path, among(*FEW, "pressure_offset"))
    (entry,) = [c for c in found["candidates"] if c["effect"] == "friction_hysteresis"]
    assert entry["status"] == "not_testable"
    assert "falling" in entry["reason"]
    assert not any("friction_hysteresis" in c for c in found["classes"])
    assert any("pressure_offset" in c for c in found["classes"])


def test_held_out_errors_say_what_they_are(friction):
    folder, found = friction
    assert "same states chose the effects" in found["heldout_is"]
    for name in ("terminal.txt", "report.html"):
        assert found["heldout_is"] in " ".join((folder / name).read_text().split())


@pytest.mark.parametrize(
    ("change", "overrides", "message"),
    [
        (lambda t: t, ["train=sample9"], "sample9"),
        (lambda t: t, ["fit=adam"], "levenberg_marquardt"),
        (lambda t: t, ["effects=[no_such]"], "no_such"),
        (lambda t: t, ["data.accuracy.force_n=0"], "force_n"),
        (lambda t: t, ["data.accuracy=guess"], "estimate"),
        (lambda t: t.assign(buckled=1), [], "marked as buckled"),
        (lambda t: t.drop(columns=["force_n", "moment_nmm"]), [], "force_n"),
    ],
)
def test_bad_input_is_one_clear_error(change, overrides, message, tmp_path):
    with pytest.raises(UserError, match=message):
        run(change(table({}, share=0.1)), tmp_path, *overrides)
    assert not (tmp_path / "discovery.json").exists()


@pytest.mark.parametrize(
    ("few", "says"),
    [
        (lambda t: t[:1], "1 row with 2 readings: too few"),
        (lambda t: t[:2], "2 rows with 4 readings: too few"),
        (lambda t: t[:8], "8 rows of a single kinematic state"),
        (
            lambda t: t.iloc[[0] * 5].assign(step=range(5), force_n=[1.0, 1.1, 0.9, 1.05, 1.0]),
            "Nothing that the bed imposes varies",
        ),
    ],
    ids=["a row", "two rows", "a state", "nothing varies"],
)
def test_a_table_that_can_tell_nothing_is_undecided_and_says_why(few, says, tmp_path):
    found = run(few(table({}, share=0.1)), tmp_path, "checks=off")
    assert (found["verdict"], found["effects"]) == ("undecided", [])
    assert says.lower() in found["says"].lower()
    (check,) = found["referee"]
    assert (check["name"], check["result"]) == ("enough rows", "cannot_tell")
    assert (tmp_path / "report.html").exists()


@pytest.mark.slow
def test_the_command_itself(commands, tmp_path):
    path = tmp_path / "table.csv"
    table(FRICTION, samples=(3,), share=0.1).to_csv(path, index=False)
    asked = ["data=csv", f"data.path={path}", f"hydra.run.dir={tmp_path / 'out'}", QUICK]
    line = [sys.executable, "discover.py", *asked]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "Named: friction_hysteresis was missing" in done.stdout
    curves = pd.read_csv(tmp_path / "out" / "curves_1.csv")
    assert all(curves.loc[curves["what"] == when, "force_n_low"].notna().any() for when in ("before", "after"))
    for name in ("staircase", "ranking", "likeness", "residuals_before", "residuals_after", "curves_1"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 5000
        assert (tmp_path / "out" / f"{name}.csv").exists()
    again = commands.run("discover", *asked, "train=sample9")
    assert again.status == 1
    assert again.err.startswith("error: ")
    assert "Traceback" not in again.err


@pytest.mark.nightly
def test_bad_readings_are_pointed_out_and_change_no_verdict(friction, tmp_path):
    data = table(FRICTION, samples=(3,))
    data.loc[[40, 41], "force_n"] += 5.0
    found = run(data, tmp_path, QUICK)
    assert found["effects"] == ["friction_hysteresis"]
    assert {42, 43} <= {line for suspect in found["suspects"] for line in suspect["lines"]}
    worst = found["suspects"][0]
    assert (worst["line"] in (42, 43), worst["load"], worst["unit"], worst["sample"]) == (True, "force", "N", 3)
    assert worst["shown"] == pytest.approx(data.loc[worst["line"] - 2, "force_n"])
    assert worst["expected"] == pytest.approx(worst["shown"] - 5.0, abs=0.2)
    assert worst["sigmas"] > 6
    # Left out, they leave the answer as it was.
    again = run(pd.read_csv(tmp_path / "marked.csv"), tmp_path / "again", QUICK)
    assert (again["verdict"], again["effects"], again["classes"]) == (
        found["verdict"],
        found["effects"],
        found["classes"],
    )
    assert again["left_out"] == len({line for suspect in found["suspects"] for line in suspect["lines"]})


SLIPPED = [
    Suspect(40, "force", 3.2, 45.1, -420.3, "another row's reading", (40,), 47),
    *(
        Suspect(n, "moment", 0.5, 0.25, 12.0 + n / 10, "a block with another scale", (100, 101, 102))
        for n in (100, 101, 102)
    ),
    *(Suspect(200 + 10 * n, "force", 3.2, 3.0, 6.5 - n / 100, "", (200 + 10 * n,)) for n in range(10)),
]
# A block's readings can be put right, so its rows are named, and not left out.
LEFT_OUT = {42, *range(202, 302, 10)}
LINES = LEFT_OUT | {102, 103, 104}


@pytest.fixture(scope="module")
def slipped(searched, tmp_path_factory):
    """That search, had it suspected SLIPPED."""
    folder = tmp_path_factory.mktemp("slipped")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "search", lambda *asked: replace(searched[-1], suspects=SLIPPED))
        found = run(table(FRICTION), folder, "figures=true", "bands=false")
    return folder, found


def test_suspects_are_told_by_line_in_every_form(slipped):
    folder, found = slipped
    listed = found["suspects"]
    first = listed[0]
    place = table(FRICTION).loc[40]
    assert {name: first[name] for name in ("sample", "step", "elongation_mm", "twist_deg", "pressure_kpa")} == {
        name: pytest.approx(place[name]) for name in ("sample", "step", "elongation_mm", "twist_deg", "pressure_kpa")
    }
    assert (first["line"], first["shown"], first["expected"], first["unit"]) == (42, 3.2, 45.1, "N")
    assert (first["sigmas"], first["lines"]) == (-420.3, [42])
    assert first["slip"] == "another row's reading, perhaps line 49's"
    block = listed[1]
    assert (block["line"], block["load"], block["unit"], block["lines"]) == (104, "moment", "N·mm", [102, 103, 104])
    assert (block["shown"], block["expected"]) == pytest.approx((500, 250))
    assert [abs(entry["sigmas"]) for entry in listed] == sorted((abs(s.sigmas) for s in SLIPPED), reverse=True)

    written = pd.read_csv(folder / "suspects.csv", keep_default_na=False)
    assert list(written) == list(first)
    assert written["line"].tolist() == [entry["line"] for entry in listed]
    assert written["lines"].astype(str).tolist()[:2] == ["42", "102 103 104"]

    text = " ".join((folder / "terminal.txt").read_text().split())
    assert "Suspected readings" in text
    # A block is one row of the terminal's table, eight of which are shown.
    assert "102–104" in text
    assert "… 4 more in suspects.csv" in text
    told = "Line 42: the force shows +3.2 N where +45.1 N was expected (−420 σ): another row's reading"
    assert f"{told}, perhaps line 49's." in text
    page = (folder / "report.html").read_text()
    assert told.replace("'", "&#39;") in page
    assert "<details><summary>all 14 of them</summary>" in page
    for line in LINES:
        assert f'<td class="words">{line}</td>' in page


@pytest.mark.nightly
def test_the_marked_table_is_the_users_own_and_leaves_their_rows_out(slipped, tmp_path):
    folder, found = slipped
    original, marked = (folder / "table.csv").read_text(), (folder / "marked.csv").read_text()
    for number, (line, other) in enumerate(zip(original.splitlines(), marked.splitlines(), strict=True), 1):
        assert other == f"{line},{'left_out' if number == 1 else '1' if number in LEFT_OUT else ''}"
    # However wrong, what is marked changes nothing.
    wild = pd.read_csv(folder / "marked.csv")
    wild.loc[wild["left_out"] == 1, ["force_n", "moment_nmm"]] *= -1000
    answers = [
        run(data, tmp_path / name, QUICK)
        for name, data in (("wild", wild), ("same", pd.read_csv(folder / "marked.csv")))
    ]
    for name in ("verdict", "effects", "classes", "error", "trail", "candidates", "failures", "suspects", "tests"):
        assert answers[0][name] == answers[1][name]
    assert answers[0]["left_out"] == len(LEFT_OUT)
    assert found["left_out"] == 0
    assert answers[0]["rows"] == found["rows"] - len(LEFT_OUT)
    assert any(f"marked to be left out: {len(LEFT_OUT)}" in note for note in answers[0]["notes"])


def test_suspects_are_drawn_apart_and_do_not_blame_the_model(slipped, friction):
    folder, found = slipped
    # The worst suspect's state has curves of its own.
    points = pd.concat([pd.read_csv(path) for path in sorted(folder.glob("curves_*.csv"))])
    aside = points[points["what"] == "suspected reading"]
    assert table(FRICTION).loc[40, "force_n"] == pytest.approx(aside["force_n"].iloc[0])
    assert "Crosses: suspected readings" in (folder / "report.html").read_text()
    before = pd.read_csv(folder / "predictions_before.csv")
    assert len(before) == friction[1]["rows"]
    assert "left_out" not in before
    maps = pd.read_csv(folder / "residuals_before.csv")
    assert maps["rows"].sum() == len(before) - len(LEFT_OUT)
    whole = sum(f["rows"] for f in friction[1]["failures"])
    assert 0 < sum(f["rows"] for f in found["failures"]) <= whole


@pytest.mark.nightly
def test_a_later_search_leaves_no_marks_of_an_earlier_one(tmp_path):
    (tmp_path / "marked.csv").write_text("of an earlier search")
    found = run(table(FRICTION, samples=(3,), share=0.1), tmp_path, QUICK)
    assert found["suspects"] == []
    assert not (tmp_path / "marked.csv").exists()
    assert len(pd.read_csv(tmp_path / "suspects.csv")) == 0


def test_the_table_of_steps_cuts_no_number_short(friction):
    folder, found = friction
    text = (folder / "terminal.txt").read_text()
    assert "…" not in text.split("Where the model failed")[0]
    for entry in found["trail"]:
        assert f"{100 * entry['E_heldout']:.3f}" in text


@pytest.mark.slow
@pytest.mark.parametrize("every", usually(12, nightly=[6, 1]))
def test_real_measurements_are_not_explained_away(every, shared_data, tmp_path):
    # Another laboratory's bed: its force follows a fifth of the pressure's thrust, and its own notes say that nobody
    # knows why. An answer that claims to have explained it would be wrong.
    path = shared_data / "free70_single" / "measurements.csv"
    # A look at the table sees that much is odd; the search is not to claim anything without it either.
    rows = pd.read_csv(path)
    rows = rows[(rows["step"] == 0).cumsum() % every == 0]
    # By day of few effects, and all forms that can be written.
    few = among("threshold_pressure", "force_gain", "friction_hysteresis")
    found = run(rows, tmp_path, "checks=off", *([] if EVERY else [few]))
    assert found["verdict"] == "unexplained"
    assert found["error"]["before"] > 1.0
    assert found["error"]["after"] > 3 * found["error"]["noise_floor"]
    assert "pressure" in found["failures"][0]["where"]
    assert found["failures"][0]["mean_force_n"] > 0
    assert any("times larger than data.accuracy says" in note for note in found["notes"])
