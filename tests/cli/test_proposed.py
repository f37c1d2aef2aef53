"""`python discover.py` where the library ends: the effect that it writes, as a file that is used like one's own."""

import ast
import json
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from outside_tables import KINDS, measured
from rich.console import Console
from small_runs import run as train_run

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.common.errors import UserError
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models import own_files

# What the search may name: the rest is ruled out, so that a search takes seconds.
LIBRARY = ("wall_stiffening", "force_gain", "force_offset", "pressure_gain", "end_clamps", "twist_offset")
KIND = "slack_cable"
ENTRY = {"file", "port", "inputs", "formula", "parameters", "error", "twins"}


def run(table, folder, *overrides):
    folder.mkdir(exist_ok=True)
    path = folder / "table.csv"
    table.to_csv(path, index=False)
    others = ",".join(name for name in EFFECTS if name not in LIBRARY)
    asked = settings(
        DiscoverSettings,
        ["data=csv", f"data.path={path}", "train=all", "figures=false", f"ruled_out=[{others}]", *overrides],
    )
    with open(folder / "terminal.txt", "w") as file:
        discover(asked, folder, Console(file=file, width=100))
    return json.loads((folder / "discovery.json").read_text())


@pytest.fixture(scope="module")
def table():
    return measured(KINDS[KIND].extra, samples=(3,), seed=4).table


@pytest.fixture(scope="module")
def written(table, tmp_path_factory):
    before = dict(EFFECTS)
    folder = tmp_path_factory.mktemp("written")
    found = run(table, folder)
    assert before == EFFECTS
    return folder, found


@pytest.fixture
def clean(monkeypatch):
    """No files named, none read yet; afterwards the library is what it was."""
    for name in own_files.VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(own_files, "_READ", {})
    before = dict(EFFECTS)
    yield monkeypatch
    for name in set(EFFECTS) - set(before):
        del EFFECTS[name]


def entry_of(found) -> dict:
    (entry,) = found["proposals"]
    return entry


def test_the_verdict_is_proposed_and_the_entry_has_the_contracts_fields(written):
    folder, found = written
    assert found["verdict"] == "proposed"
    entry = entry_of(found)
    assert set(entry) >= ENTRY
    assert [entry["name"]] == found["effects"]
    assert entry["file"] == f"proposed_{entry['name']}.py"
    assert (folder / entry["file"]).is_file()
    assert [p.name for p in folder.glob("*.py")] == [entry["file"]]
    kind = KINDS[KIND]
    assert f"{entry['port']} {entry['where']}" in kind.places
    assert tuple(entry["inputs"]) == kind.inputs
    assert entry["form"] in kind.families
    # The cable pulls by 50 N/m, six times, beyond 2 mm: the force on it falls as the bed's rises.
    values = {name: p["value"] for name, p in entry["parameters"].items()}
    assert all(set(p) >= {"value", "stderr", "unit"} for p in entry["parameters"].values())
    scale = entry["in_units_of"]["elongation"]["value"]
    for value, true, name in ((values["amount"] / scale, 300.0, "amount"), (values["knee"], 2e-3, "knee")):
        error = entry["parameters"][name]["stderr"] / (scale if name == "amount" else 1)
        assert 0 < error < 0.2 * true
        assert abs(value - true) < 4 * error
    assert (entry["parameters"]["amount"]["unit"], entry["parameters"]["knee"]["unit"]) == ("N", "m")


def test_the_error_falls_to_about_the_noise_floor(written):
    _, found = written
    error = entry_of(found)["error"]
    assert set(error) == {"before", "after", "noise_floor"}
    assert error == found["error"]
    assert error["before"] > error["after"] > 0.8 * error["noise_floor"]
    assert error["after"] < 1.35 * error["noise_floor"]


def test_the_port_that_shows_the_very_same_stands_among_the_twins(written):
    _, found = written
    entry = entry_of(found)
    for twin in entry["twins"]:
        assert set(twin) >= {"port", "formula", "E_heldout"}
        assert twin["E_heldout"] is None or twin["E_heldout"] == pytest.approx(entry["error"]["after"], rel=0.1)
    assert [(t["port"], t["formula"]) for t in entry["twins"] if t["E_heldout"] is None] == [
        ("measurement", entry["formula"])
    ]


def test_where_else_it_could_enter_is_told_with_what_each_place_promised(written):
    _, found = written
    places = entry_of(found)["places"]
    assert len({(p["port"], p["where"], *p["inputs"]) for p in places}) == len(places) > 1
    sigmas = [p["sigmas"] for p in places]
    assert all(s > 0 for s in sigmas)
    assert any(f"{p['port']} {p['where']}" in KINDS[KIND].places for p in places[:2])
    assert all("{" not in p["formula"] for p in places)


def test_the_files_docstring_tells_the_evidence(written):
    """The error before and after, the noise floor, the constants and how to use it."""
    folder, found = written
    entry = entry_of(found)
    text = (folder / entry["file"]).read_text(encoding="utf-8")
    told = " ".join(ast.get_docstring(ast.parse(text)).split())
    for share in entry["error"].values():
        assert f"{100 * share:.3g}".rstrip("0").rstrip(".") in told
    assert entry["formula"] in told
    assert f"FREELEARN_EFFECTS={entry['file']}" in told
    assert f"effects=[{entry['name']}]" in told
    assert "±" in told
    assert max(map(len, text.splitlines())) <= 120


def test_page_and_terminal_tell_of_it(written):
    folder, found = written
    entry = entry_of(found)
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert found["says"] in report
    assert entry["name"] in report
    assert entry["name"] in (folder / "terminal.txt").read_text().replace("\n", "")


def test_a_training_with_the_file_reaches_the_same_error(written, table, tmp_path, clean):
    """On all rows, of which a training fits nine tenths; a search weighs them a little otherwise."""
    folder, found = written
    entry = entry_of(found)
    clean.setenv("FREELEARN_EFFECTS", str(folder / entry["file"]))
    trained = tmp_path / "run"
    data = ["data=csv", f"data.path={folder / 'table.csv'}", "train=all", "figures=false"]
    train_run(trained, *data, "split.train=0.9", "split.validation=0.05", f"effects=[{entry['name']}]")
    errors = []
    for file in (trained / "predictions.csv", folder / "predictions_after.csv"):
        rows = pd.read_csv(file)
        loads = [("force", "n"), ("moment", "nmm")]
        scaled = [(rows[f"{x}_pred_{u}"] - rows[f"{x}_{u}"]) / rows[f"{x}_{u}"].abs().max() for x, u in loads]
        errors.append(float(np.sqrt((scaled[0] ** 2 + scaled[1] ** 2).mean())))
    assert errors[0] == pytest.approx(errors[1], rel=0.05)
    fitted = freelearn.load(trained)
    knee = entry["parameters"]["knee"]
    assert fitted.parameters[f"{entry['name']}.knee"] == pytest.approx(knee["value"], abs=5 * knee["stderr"])


def test_the_folder_is_read_again_with_the_file_named(written, clean):
    folder, found = written
    entry = entry_of(found)
    clean.setenv("FREELEARN_EFFECTS", str(folder / entry["file"]))
    fitted = freelearn.load(folder)
    assert fitted.title == f"continuum + {entry['name']}"
    for name, p in entry["parameters"].items():
        assert fitted.parameters[f"{entry['name']}.{name}"] == pytest.approx(p["value"], rel=1e-12)
    rows = pd.read_csv(folder / "predictions_after.csv")
    answer = fitted.predict(rows)
    np.testing.assert_allclose(answer.loads[:, 0], rows["force_pred_n"], rtol=1e-6, atol=1e-9)
    assert np.isfinite(answer.half).all()


def test_without_the_file_the_folder_is_refused_in_one_sentence(written, clean):
    folder, found = written
    name = entry_of(found)["name"]
    with pytest.raises(UserError, match=rf"(?s)Unknown effect '{name}'.*FREELEARN_EFFECTS") as raised:
        freelearn.load(folder)
    assert "\n" not in str(raised.value)
    assert name not in EFFECTS


def test_what_a_folder_names_is_never_run(written, tmp_path, clean):
    """Neither a file that discovery.json names, nor the written one where nobody named it, nor one beside them."""
    folder, found = written
    entry = entry_of(found)
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("checkpoint.ckpt", "predictions_after.csv", "predictions_before.csv", "table.csv"):
        (copy / name).write_bytes((folder / name).read_bytes())
    marker = tmp_path / "ran"
    evil = f"from pathlib import Path\nPath({str(marker)!r}).write_text('x')\n"
    tampered = json.loads((folder / "discovery.json").read_text())
    tampered["proposals"][0] |= {"file": "evil.py", "formula": f"__import__('os').mknod({str(marker)!r})"}
    tampered["proposals"][0]["name"] = "evil"
    # Whoever tampers can take the digest out as well.
    del tampered["digest"]
    (copy / "discovery.json").write_text(json.dumps(tampered))
    for name in ("evil.py", entry["file"], "proposed_evil.py"):
        (copy / name).write_text(evil)
    with pytest.raises(UserError, match="Unknown effect"):
        freelearn.load(copy)
    clean.setenv("FREELEARN_EFFECTS", str(folder / entry["file"]))
    fitted = freelearn.load(copy)
    assert entry["name"] in fitted.title
    freelearn.plan(copy, rows=1)
    assert not marker.exists()


def test_a_later_search_takes_the_file_as_one_of_its_candidates(written, table, tmp_path, clean):
    """Then it is in the library: named, and nothing more is written."""
    folder, found = written
    entry = entry_of(found)
    clean.setenv("FREELEARN_EFFECTS", str(folder / entry["file"]))
    own_files.load_own_code()
    others = ",".join(name for name in EFFECTS if name not in (*LIBRARY, entry["name"]))
    again = run(table, tmp_path / "again", f"ruled_out=[{others}]")
    assert (again["verdict"], again["effects"], again["proposals"]) == ("named", [entry["name"]], [])
    assert again["error"]["after"] == pytest.approx(found["error"]["after"], rel=0.01)
    assert not list((tmp_path / "again").glob("*.py"))


@pytest.mark.nightly
def test_from_a_shell_the_file_serves_as_the_docstring_says(written, tmp_path):
    """A process of its own, in the run's folder's neighborhood."""
    folder, found = written
    entry = entry_of(found)
    code = "import sys, freelearn; print(freelearn.load(sys.argv[1]).title)"
    environment = os.environ | {"FREELEARN_EFFECTS": entry["file"], "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, "."], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == f"continuum + {entry['name']}"


def test_where_nothing_is_missing_nothing_is_written(tmp_path):
    found = run(measured(samples=(3,), seed=5).table, tmp_path)
    assert (found["verdict"], found["effects"], found["proposals"]) == ("adequate", [], [])
    assert not list(tmp_path.glob("*.py"))


# By day an interrupted search that goes on has to end the same (test_discover.py).
@pytest.mark.slow
@pytest.mark.nightly
def test_the_same_seed_writes_the_same(written, table, tmp_path):
    folder, found = written
    again = run(table, tmp_path / "again")
    assert again["proposals"] == found["proposals"]
    name = entry_of(found)["file"]
    assert (tmp_path / "again" / name).read_text() == (folder / name).read_text()
