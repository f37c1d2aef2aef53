"""What the README tells a user to do, done."""

import json
import os
import re
import shlex
import subprocess
import sys

import pytest
from conftest import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def section(heading):
    return README.split(f"## {heading}\n")[1].split("\n## ")[0]


@pytest.mark.slow
def test_an_effect_of_ones_own_as_written(tmp_path):
    text = section("Your own effect")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (line,) = re.findall(r"```\n(FREELEARN_EFFECTS=.*?)\n```", text, re.DOTALL)
    (tmp_path / "leak.py").write_text(code)
    setting, python, *words = shlex.split(line)
    assert (setting, python) == ("FREELEARN_EFFECTS=leak.py", "python")
    done = subprocess.run(
        [sys.executable, *words, f"hydra.run.dir={tmp_path / 'run'}", "fits=null"],
        cwd=ROOT, env=os.environ | {"FREELEARN_EFFECTS": str(tmp_path / "leak.py")},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert results["effects"] == ["line_loss"]
    assert results["parameters"]["line_loss.share"]["stderr"] > 0
    assert "FREELEARN_EFFECTS=" in (tmp_path / "run" / "report.html").read_text()
    # Nothing but the environment variable runs the file.
    without = {name: value for name, value in os.environ.items() if name != "FREELEARN_EFFECTS"}
    again = subprocess.run(
        [sys.executable, *words, f"hydra.run.dir={tmp_path / 'other'}"],
        cwd=ROOT, env=without, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert again.returncode != 0
    assert "Unknown effect 'line_loss'" in again.stderr


def test_every_picture_and_page_it_points_to_is_there():
    for target in re.findall(r"\]\((?!https?:)([^)]+)\)", README):
        assert (ROOT / target).is_file(), target


def test_every_override_it_lists_exists():
    models = {path.stem for path in (ROOT / "conf" / "model").glob("*.yaml")}
    assert models <= set(re.findall(r"`(\w+)`", section("Fit a model")))
    for group in ("fit", "split"):
        for path in (ROOT / "conf" / group).glob("*.yaml"):
            assert f"`{path.stem}`" in README
    for path in (ROOT / "conf" / "experiment").glob("*.yaml"):
        assert path.stem in section("The paper's study")
