"""The story that README and docs/reading.md tell: its numbers and pictures are those that its command writes today."""

import json
import math
import re

import pytest
from conftest import ROOT
from PIL import Image
from test_readme import README, page, typed

pytestmark = pytest.mark.slow

PICTURES = sorted((ROOT / "docs" / "story").glob("*.png"))


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """The folder that the command leaves which README shows, and what it found."""
    (line,) = re.findall(r"^`(python discover.py data.hidden=random .*?) hydra", README, re.MULTILINE)
    folder = tmp_path_factory.mktemp("story") / "run"
    done = typed(line, folder)
    assert done.returncode == 0, done.stderr
    return folder, json.loads((folder / "discovery.json").read_text())


def test_the_numbers_in_the_text_are_those_of_the_command(story):
    folder, found = story
    hidden = json.loads((folder / "sealed_answer.json").read_text())["hidden"]
    last, error, worst = found["trail"][-1], found["error"], found["failures"][0]
    steps = [f"{100 * step['E_heldout']:.3g} %" for step in found["trail"]]
    told = [found["says"], *steps, f"{100 * error['before']:.2g} %"]
    told += [f"{abs(worst['mean_force_n']):.3g} N too high", f"{worst['sigma_force']:.1f} σ", worst["where"]]
    for name, digits in (("fiber_tension_only.share", ".4f"), ("length_compliance.compliance", ".3e")):
        effect, parameter = name.split(".")
        told += [format(hidden[effect][parameter], digits), format(last["parameters"][name], digits)]
    missing = [text for text in told if text not in README]
    assert not missing
    # The measuring alone leaves less than that, at every step.
    assert max(step["noise_floor"] for step in found["trail"]) < 0.008
    assert "less than 0.8 %" in README
    for text in (f"{abs(worst['mean_force_n']):.3g} N too high", f"{worst['sigma_force']:.1f} σ"):
        assert text in page("reading")


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.stem)
def test_the_pictures_show_what_the_command_draws(story, picture):
    then = json.loads(Image.open(picture).text["Description"])
    now = json.loads(Image.open(story[0] / picture.name).text["Description"])
    assert then.keys() == now.keys()
    for name, ends in now.items():
        # What is zero but for rounding differs from machine to machine.
        size = max(map(abs, ends))
        assert all(math.isclose(a, b, rel_tol=2e-3, abs_tol=2e-3 * size) for a, b in zip(then[name], ends, strict=True))
