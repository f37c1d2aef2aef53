"""The pictures of README and docs, and the story that they tell, are what their commands draw and write today."""

import json
import math
import re
import shlex
import subprocess
import sys

import pytest
from conftest import ROOT
from PIL import Image
from test_readme import README, page

sys.path.insert(0, str(ROOT / "experiments"))

from pictures import ALL, STORY

pytestmark = pytest.mark.slow

# Those of measured data and of hours of searches are not drawn here, and the effects' have a test of their own.
OURS = {key: each for key, each in ALL.items() if not each.measured and key != "reachable_poses"}
PICTURES = [f"{name}.png" for each in OURS.values() for name in each.pictures]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """The folders of the pictures, drawn anew, and of the runs that they come from."""
    docs, work = tmp_path_factory.mktemp("docs"), tmp_path_factory.mktemp("work")
    command = [sys.executable, "experiments/pictures.py", *OURS, "--docs", str(docs), "--work", str(work)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return docs, work


@pytest.fixture(scope="module")
def story(drawn):
    """The folder that the command leaves which README shows, and what it found."""
    (line,) = re.findall(r"^`(python discover.py data.hidden=random .*?) hydra", README, re.MULTILINE)
    assert shlex.split(line)[1:] == STORY[:-1]
    folder = drawn[1] / "story"
    return folder, json.loads((folder / "discovery.json").read_text())


@pytest.mark.nightly
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


@pytest.mark.nightly
def test_the_first_files_give_what_their_page_says(drawn):
    """What is hidden in the simulated ones is named, as large as the page says."""
    told = " ".join(page("starts").split())
    for name, effect, says in (
        ("free", "friction_hysteresis.force", "{:.3f} ± {:.3f} N where 0.6 N"),
        ("three", "fiber_misalignment.angle[2]", "{:.4f} ± {:.4f} rad of the second"),
        ("artery", "length_offset.length", "{:.3f} ± {:.3f} mm"),
    ):
        found = json.loads((drawn[1] / name / "discovery.json").read_text())
        assert found["verdict"] == "named"
        value = found["parameters"][effect]
        size = 1e3 if name == "artery" else 1
        assert says.format(size * value["value"], size * value["stderr"]) in told
    muscle = json.loads((drawn[1] / "muskel" / "discovery.json").read_text())
    before, after = (100 * muscle["error"][when] for when in ("before", "after"))
    assert f"{before:.2f} to {after:.2f} %" in told
    # Which third one, its lengths do not tell.
    assert muscle["verdict"] == "undecided"
    assert muscle["effects"] == ["small_strain_stiffness", "end_taper", "force_offset"]


@pytest.mark.nightly
@pytest.mark.parametrize("name", PICTURES)
def test_the_pictures_show_what_their_commands_draw(drawn, name):
    then, now = (Image.open(folder / name) for folder in (ROOT / "docs", drawn[0]))
    assert then.size == now.size
    before, after = (json.loads(image.text["Description"]) for image in (then, now))
    assert before.keys() == after.keys()
    for column, ends in after.items():
        # What is zero but for rounding differs from machine to machine.
        size = max(map(abs, ends))
        pairs = zip(before[column], ends, strict=True)
        assert all(math.isclose(a, b, rel_tol=2e-3, abs_tol=2e-3 * size) for a, b in pairs)


def test_every_picture_of_the_documentation_has_a_command_and_says_what_it_shows():
    made = {f"{name}.png" for each in ALL.values() for name in each.pictures}
    docs = ROOT / "docs"
    for path in docs.glob("*/*.png"):
        name = path.relative_to(docs).as_posix()
        assert name in made or path.parent.name in ("effects", "benchmark"), name
        assert json.loads(Image.open(path).text["Description"]), name
