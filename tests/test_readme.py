"""What README and docs tell a user to do, done."""

import json
import re
import shlex

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from ended import Ended
from hidden_tables import QUICK
from nightly import EVERY

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted((ROOT / "docs").glob("*.md"))


def page(name):
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


@pytest.fixture
def typed(commands):
    """What a line of README and docs does: its own environment is taken from `environment`."""

    def run(line: str, *more: str, **environment: str) -> Ended:
        words = [word for word in shlex.split(line) if not word.startswith("FREELEARN_")]
        assert words[0] == "python"
        # A file beside README, or a module.
        name = words[2].removeprefix("freelearn.") if words[1] == "-m" else words[1].removesuffix(".py")
        assert words[1] == "-m" or (ROOT / words[1]).exists()
        return commands.run(name, *words[3 if words[1] == "-m" else 2 :], *more, cwd=ROOT, **environment)

    return run


@pytest.mark.slow
def test_an_effect_of_ones_own_as_written(typed, tmp_path):
    text = page("own_effect")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    search, fit = re.findall(r"^(FREELEARN_EFFECTS=gauge.py python .*)$", text, re.MULTILINE)
    own = tmp_path / "gauge.py"
    own.write_text(code)
    # Pictures, of an own effect as of any, take longer than the rest; by day it is found among a few.
    more = ["figures=false", *([] if EVERY else [QUICK])]
    done = typed(search, f"hydra.run.dir={tmp_path / 'search'}", *more, FREELEARN_EFFECTS=str(own))
    assert done.status == 0, done.told
    found = json.loads((tmp_path / "search" / "discovery.json").read_text())
    assert (found["verdict"], found["effects"]) == ("named", ["bent_gauge"])
    assert found["trail"][-1]["parameters"]["bent_gauge.share"] == pytest.approx(0.1, abs=0.01)
    done = typed(fit, f"hydra.run.dir={tmp_path / 'run'}", more[0], FREELEARN_EFFECTS=str(own))
    assert done.status == 0, done.told
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert results["effects"] == ["bent_gauge"]
    without, together = (results["comparison"]["sample3"][name] for name in ("without", "with"))
    assert together < 0.8 * without
    # A fifth of the states are tested on: with some 25 position errors in it, E scatters by a tenth.
    assert together < 1.3 * results["noise_floor"]
    assert "FREELEARN_EFFECTS=" in (tmp_path / "run" / "report.html").read_text()
    # Nothing but the environment variable runs the file.
    again = typed(fit, f"hydra.run.dir={tmp_path / 'other'}")
    assert again.status != 0
    assert "Unknown effect 'bent_gauge'" in again.err


@pytest.mark.slow
@pytest.mark.nightly
def test_a_model_of_ones_own_as_written(typed, commands, tmp_path):
    text = page("own_model")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (line,) = re.findall(r"^(FREELEARN_MODELS=muscle.py python .*)$", text, re.MULTILINE)
    own = tmp_path / "muscle.py"
    own.write_text(code)
    # Drawn by a command of its own below.
    done = typed(line, f"hydra.run.dir={tmp_path / 'run'}", "figures=false", FREELEARN_MODELS=str(own))
    assert done.status == 0, done.told
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert results["model"] == "braided"
    assert all(p["stderr"] > 0 for p in results["parameters"].values())
    # In a search, of a table that it is the truth of but for an offset; and its checkpoint drawn.
    rows = pd.read_csv(tmp_path / "run" / "predictions.csv")
    rows = rows[(rows["sample"] == 3) & ((rows["step"] == 0).cumsum() % 3 == 0)]
    noise = np.random.default_rng(0).normal(size=(2, len(rows)))
    rows = rows.assign(force_n=rows["force_pred_n"] + 1.0 + 0.03 * noise[0], buckled=0)
    rows = rows.assign(moment_nmm=rows["moment_pred_nmm"] + 0.6 * noise[1])
    rows[[name for name in rows if "pred" not in name and name not in ("split", "status")]].to_csv(
        tmp_path / "small.csv", index=False
    )
    small = ["data=csv", f"data.path={tmp_path / 'small.csv'}", f"hydra.run.dir={tmp_path / 'search'}"]
    found = typed(line.replace("train.py", "discover.py"), *small, "figures=false", FREELEARN_MODELS=str(own))
    assert found.status == 0, found.told
    content = json.loads((tmp_path / "search" / "discovery.json").read_text())
    assert (content["model"], content["effects"]) == ("braided", ["force_offset"])
    drawn = commands.run("figures", str(tmp_path / "run"), cwd=ROOT, FREELEARN_MODELS=str(own))
    assert drawn.status == 0, drawn.told
    again = typed(line, f"hydra.run.dir={tmp_path / 'other'}")
    assert again.status != 0
    assert "braided" in again.err


# Names of recordings in the rubber page's commands.
RECORDED = r"\w+=((?:hold|pull|shear)\w*)\.csv"


def _lines_of(name):
    return re.findall(r"^(python .*)$", page(name), re.MULTILINE)


@pytest.mark.slow
@pytest.mark.nightly
def test_the_rubbers_commands_take_recordings(typed, tmp_path):
    """A neo-Hookean rubber with one arm on Q = λ − 1/λ², in small steps; of shear Q = γ."""
    lines, time = [line for line in _lines_of("rubber") if re.search(RECORDED, line)], np.arange(0.0, 20.0, 1.0)
    assert len(lines) == 2
    for number, name in enumerate(["hold_150", "hold_300", "pull_slow", "pull_fast", "shear", "shear_fast"]):
        rate = 0.5 if "fast" in name or "hold" in name else 0.1
        strain = np.minimum(rate * time, 2.0 if "300" in name else 1.0)
        q, stress = (strain if "shear" in name else 1 + strain - (1 + strain) ** -2), np.zeros_like(time)
        for n in range(1, len(time)):
            stress[n] = (stress[n - 1] + 0.05 * (q[n] - q[n - 1])) / 1.05
        stress += 0.1 * q + 1e-4 * np.random.default_rng(number).normal(size=len(q))
        imposed = {"shear": strain} if "shear" in name else {"stretch": 1 + strain}
        table = pd.DataFrame({"time_s": time, **imposed, "stress_mpa": stress, "specimen": name})
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    both = [pd.read_csv(tmp_path / f"{name}.csv") for name in ("shear", "shear_fast")]
    pd.concat(both).to_csv(tmp_path / "shear.csv", index=False)
    for line in lines:
        line = re.sub(RECORDED, lambda found: found[0].replace("=", f"={tmp_path}/"), line)
        done = typed(line, "--out", str(tmp_path / "told"))
        assert done.status == 0, done.told
        assert (tmp_path / "told" / "curves.png").exists()


@pytest.mark.slow
def test_the_rubbers_commands_lead_into_each_other(typed, tmp_path, shared_data):
    lines = [line for line in _lines_of("rubber") if not re.search(RECORDED, line)]
    assert len(lines) == 3
    # What --best compares is asked of recordings above, and of these data in tests/fitting; each takes ten seconds.
    lines = [line for line in lines if EVERY or "--best" not in line]
    folder = shared_data / "rubber" / "treloar_1944"
    for line in lines:
        for short, name in (("UT", "uniaxial"), ("ET", "equibiaxial"), ("PS", "pure_shear")):
            line = line.replace(f"{short}={name}.csv", f"{short}={folder / short}.csv")
        line = line.replace("outputs/rubber", str(tmp_path / "rubber"))
        more = [f"hydra.run.dir={tmp_path / 'run'}", "figures=false"] if "train.py" in line else []
        more += ["--out", str(tmp_path / "compared")] if "--compare" in line else []
        done = typed(line, *more)
        assert done.status == 0, done.told
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
