"""What README and docs tell a user to do, done."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted((ROOT / "docs").glob("*.md"))


def page(name):
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


def typed(line: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """What a line of the README does: its own environment is taken from `environment`, its files go to `folder`."""
    words = [word for word in shlex.split(line) if not word.startswith("FREELEARN_")]
    assert words[0] == "python"
    clean = {name: value for name, value in os.environ.items() if not name.startswith("FREELEARN_")}
    return subprocess.run(
        [sys.executable, *words[1:], f"hydra.run.dir={folder}"],
        cwd=ROOT, env=clean | environment, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_an_effect_of_ones_own_as_written(tmp_path):
    text = page("own_effect")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    search, fit = re.findall(r"^(FREELEARN_EFFECTS=gauge.py python .*)$", text, re.MULTILINE)
    own = tmp_path / "gauge.py"
    own.write_text(code)
    done = typed(search, tmp_path / "search", FREELEARN_EFFECTS=str(own))
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "search" / "discovery.json").read_text())
    assert (found["verdict"], found["effects"]) == ("named", ["bent_gauge"])
    assert found["trail"][-1]["parameters"]["bent_gauge.share"] == pytest.approx(0.1, abs=0.01)
    done = typed(fit, tmp_path / "run", FREELEARN_EFFECTS=str(own))
    assert done.returncode == 0, done.stderr
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert results["effects"] == ["bent_gauge"]
    without, together = (results["comparison"]["sample3"][name] for name in ("without", "with"))
    assert together < 0.8 * without
    # A fifth of the states are tested on: with some 25 position errors in it, E scatters by a tenth.
    assert together < 1.3 * results["noise_floor"]
    assert "FREELEARN_EFFECTS=" in (tmp_path / "run" / "report.html").read_text()
    # Nothing but the environment variable runs the file.
    again = typed(fit, tmp_path / "other")
    assert again.returncode != 0
    assert "Unknown effect 'bent_gauge'" in again.stderr


@pytest.mark.slow
def test_a_model_of_ones_own_as_written(tmp_path):
    text = page("own_model")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (line,) = re.findall(r"^(FREELEARN_MODELS=muscle.py python .*)$", text, re.MULTILINE)
    own = tmp_path / "muscle.py"
    own.write_text(code)
    done = typed(line, tmp_path / "run", FREELEARN_MODELS=str(own))
    assert done.returncode == 0, done.stderr
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert results["model"] == "braided"
    assert all(p["stderr"] > 0 for p in results["parameters"].values())
    # With an effect, in a search and a sweep, and its checkpoint drawn.
    found = typed(line.replace("train.py", "discover.py"), tmp_path / "search", FREELEARN_MODELS=str(own))
    assert found.returncode == 0, found.stderr
    assert json.loads((tmp_path / "search" / "discovery.json").read_text())["model"] == "braided"
    drawn = subprocess.run(
        [sys.executable, "-m", "freelearn.figures", tmp_path / "run"],
        cwd=ROOT, env=os.environ | {"FREELEARN_MODELS": str(own)}, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert drawn.returncode == 0, drawn.stderr
    again = typed(line, tmp_path / "other")
    assert again.returncode != 0
    assert "braided" in again.stderr


@pytest.mark.slow
def test_the_rubbers_commands_lead_into_each_other(tmp_path, shared_data):
    lines = re.findall(r"^(python .*)$", page("rubber"), re.MULTILINE)
    assert len(lines) == 3
    folder = shared_data / "rubber" / "treloar_1944"
    for line in lines:
        for short, name in (("UT", "uniaxial"), ("ET", "equibiaxial"), ("PS", "pure_shear")):
            line = line.replace(f"{short}={name}.csv", f"{short}={folder / short}.csv")
        words = line.replace("outputs/rubber", str(tmp_path / "rubber")).split()
        words += [f"hydra.run.dir={tmp_path / 'run'}"] if "train.py" in words else []
        words += ["--out", str(tmp_path / "compared")] if "--compare" in words else []
        done = subprocess.run([sys.executable, *words[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "run" / "results.json").read_text())["fit"] == "none"


def test_the_model_it_shows_is_the_one_that_is_tested():
    text = page("own_model")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    tested = (ROOT / "tests" / "support" / "braided.py").read_text()
    assert tested.endswith(code)


def targets(text):
    return [target.split("#")[0] for target in re.findall(r"\]\((?!https?:|#)([^)]+)\)", text)]


@pytest.mark.parametrize("path", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES], ids=lambda path: path.stem)
def test_every_picture_and_page_it_points_to_is_there(path):
    for target in targets(path.read_text(encoding="utf-8")):
        assert (path.parent / target).is_file(), target


def test_every_page_can_be_found():
    """From the README, and in the site's contents."""
    seen, todo = set(), [ROOT / "README.md"]
    while todo:
        path = todo.pop()
        seen.add(path)
        pages = [(path.parent / target).resolve() for target in targets(path.read_text(encoding="utf-8"))]
        todo += [target for target in pages if target.suffix == ".md" and target not in seen]
    contents = page("index")
    for path in PAGES:
        if path.stem != "index":
            assert path in seen or path.stem in ("api", "reproducibility"), path.name
            assert re.search(rf"^{path.stem}$", contents, re.MULTILINE), path.name


def test_it_is_two_screens_at_most():
    assert len(README.splitlines()) <= 90


def test_every_override_it_lists_exists():
    models = {path.stem for path in (ROOT / "conf" / "model").glob("*.yaml")}
    assert models <= set(re.findall(r"`(\w+)`", page("fit")))
    for group in ("fit", "split"):
        for path in (ROOT / "conf" / group).glob("*.yaml"):
            assert f"`{path.stem}`" in page("fit")
    for path in (ROOT / "conf" / "experiment").glob("*.yaml"):
        assert path.stem in page("study")
