"""`python intake.py` as a user runs it: a guess and a draft, then a table that train can read."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from conftest import ROOT
from ended import Ended
from nightly import EVERY

from freelearn.cli.command_line import called, command_line, installed, program, resumed
from freelearn.data.table.measurement_table import read_table

STATES = [(e, w, p) for e in (0.0, 0.002) for w in (0.0, 0.5) for p in (0.0, 0.3, 0.6)]
RAW = "Zeit;s_m;w_rad;P_bar;F_raw_N;M_raw_Nm\n" + "\n".join(
    f"{i};{e};{w};{p};{0.01 * i - 900 * e - 2.5 * p:.4f};{-0.05 * p - 0.02 * w:.6f}".replace(".", ",")
    for i, (e, w, p) in enumerate(STATES)
)


@pytest.fixture
def command(commands):
    def run(*words: str, folder: Path = ROOT) -> Ended:
        return commands.run("intake", *words, cwd=folder)

    return run


def test_from_a_raw_file_to_a_table_by_its_own_next_commands(command, tmp_path):
    # A name such as laboratories give.
    raw = tmp_path / "Prüfung 3 (b, neu).csv"
    raw.write_text(RAW, encoding="cp1252")
    first = command(f'data.path="{raw}"', f"hydra.run.dir='{tmp_path / 'my first'}'")
    assert first.status == 0, first.err
    assert "Nothing was converted" in first.out
    (recipe,) = (tmp_path / "my first").glob("*")
    assert recipe.name == "Prüfung 3 (b, neu)_recipe.yaml"
    words = shlex.split(first.out.splitlines()[-1])
    assert words[:2] == ["freelearn", "intake"]

    text = recipe.read_text(encoding="utf-8")
    for name, value in {"gamma_deg": 60, "length_mm": 90, "inner_radius_mm": 4.77, "outer_radius_mm": 6.35}.items():
        text = re.sub(rf"{name}:   # TODO.*", f"{name}: {value}", text)
    # The heading Zeit says no unit, and so none is taken for granted.
    assert "{from: Zeit, unit: }" in text
    recipe.write_text(text.replace("{from: Zeit, unit: }", "{from: Zeit, unit: s}"), encoding="utf-8")
    # As it stands: where the first was told to write to, the second does too.
    second = command(*words[2:])
    assert second.status == 0, second.err
    table = tmp_path / "my first" / "Prüfung 3 (b, neu)_table.csv"
    assert sorted(path.name for path in table.parent.iterdir()) == [
        recipe.name,
        table.name,
        "Prüfung 3 (b, neu)_table_provenance.json",
    ]
    made = read_table(table).table
    assert made["pressure_kpa"].round(9).tolist() == [0, 30, 60] * 4
    assert made["step"].tolist() == [0, 1, 2] * 4
    *_, heading, train, discover = second.out.splitlines()
    assert heading == "next:"
    for line, name in ((train, "train"), (discover, "discover")):
        assert shlex.split(line) == [
            "freelearn",
            name,
            "train=all",
            "data=csv",
            f'data.path="{table}"',
            "data.accuracy=estimate",
        ]
    assert raw.read_text(encoding="cp1252") == RAW


def test_out_names_the_table(command, tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text("P_kPa,F_N\n0,1\n30,2\n")
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(
        "bed: kinematic\nconstants: {gamma_deg: 40, length_mm: 90, inner_radius_mm: 4, outer_radius_mm: 5, "
        "twist_deg: 0, elongation_mm: 0, moment_nmm: 0.5}\ncolumns:\n  pressure_kpa: {from: P_kPa, unit: kPa}\n"
        "  force_n: {from: F_N, unit: N}\n"
    )
    run = tmp_path / "run"
    done = command(f"data.path={raw}", f"recipe={recipe}", f"out={tmp_path / 'mine.csv'}", f"hydra.run.dir={run}")
    assert done.status == 0, done.err
    assert pd.read_csv(tmp_path / "mine.csv")["force_n"].tolist() == [1, 2]
    assert (tmp_path / "mine_provenance.json").exists()
    for out in (raw, recipe):
        done = command(f"data.path={raw}", f"recipe={recipe}", f"out={out}", f"hydra.run.dir={run}")
        assert done.status == 1
        assert "choose another name" in done.err
    assert raw.read_text() == "P_kPa,F_N\n0,1\n30,2\n"


def test_mistakes_end_with_one_message_and_no_folder(command, tmp_path):
    run = tmp_path / "a" / "run"
    for words, says in (
        (["data.path=absent.csv"], "There is no file"),
        ([], "intake needs the laboratory's file"),
        (["data.path=x.csv", "+speed=3"], "speed is no option here"),
    ):
        done = command(*words, f"hydra.run.dir={run}", folder=tmp_path)
        assert done.status == 1
        assert done.err.startswith("error: ")
        assert says in done.err
        assert "Traceback" not in done.err
        assert not run.exists()


@pytest.mark.parametrize(
    ("started", "begins"), [("freelearn intake", ["freelearn", "train"]), ("intake.py", ["python"])]
)
def test_the_next_commands_are_called_as_this_one_was(started, begins, monkeypatch):
    monkeypatch.setattr(sys, "argv", [started])
    program_path, *words = program("train")
    assert [Path(program_path).name, *words][: len(begins)] == begins


def test_the_next_commands_run_where_the_shell_finds_nothing(tmp_path, monkeypatch):
    # In a checkout's folder, without its .venv on the path: typed as .venv/bin/freelearn, so told.
    monkeypatch.setenv("PATH", str(tmp_path / "none"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [".venv/bin/freelearn start"])
    assert program("discover") == [".venv/bin/freelearn", "discover"]
    assert called("predict") == ".venv/bin/freelearn predict"
    monkeypatch.setattr(sys, "argv", ["discover.py"])
    monkeypatch.setattr(sys, "executable", str(tmp_path / "my env" / "bin" / "python3"))
    assert command_line(program("discover"), []) == "'my env/bin/python3' discover.py"
    # What another package installed stands beside the interpreter, or is called by its name.
    assert installed("tensorboard") == "tensorboard"
    beside = tmp_path / "my env" / "bin" / "tensorboard"
    beside.parent.mkdir(parents=True)
    beside.touch(mode=0o755)
    assert command_line([installed("tensorboard")], []) == "'my env/bin/tensorboard'"
    found = tmp_path / "bin" / "freelearn"
    found.parent.mkdir()
    found.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(found.parent))
    monkeypatch.setattr(sys, "argv", [f"{found} start"])
    assert program("discover") == ["freelearn", "discover"]


def test_how_an_interrupted_command_goes_on_can_be_typed():
    said = resumed("hydra.run.dir", Path("/my lab/runs, old"))
    assert said == """the same command with 'hydra.run.dir="/my lab/runs, old"' goes on from here"""


def test_help_and_the_installed_command(tmp_path):
    line = [sys.executable, str(ROOT / "intake.py"), "--help"]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=True, cwd=tmp_path)
    assert "intake.py data.path=RAW" in done.stdout
    done = subprocess.run(
        [sys.executable, "-m", "freelearn", "--help"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
        cwd=tmp_path,
    )
    assert "  intake     a laboratory's raw file" in done.stdout


def test_the_next_commands_name_bed_and_members_and_run_as_they_stand(command, commands, tmp_path):
    """Two muscles on one block, whose force alone is measured: pasted into a shell, both commands read the table."""
    raw = tmp_path / "two muscles.csv"
    rows = [f"{x},{p},{q},{-p - q - 8 * x:.1f}" for x in range(0, -9, -3) for p in (0, 90, 180) for q in (0, 120)]
    raw.write_text("\n".join(["x_mm,P1,P2,F_N", *rows]))
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(
        "bed: isometric\nsample: 1\n"
        "constants: {length_mm: 150, inner_radius_mm: 5, outer_radius_mm: 6.2, twist_deg: 0}\n"
        "members:\n  - {pressure: {from: P1, unit: kPa}, gamma_deg: 24, gamma2_deg: -24}\n"
        "  - {pressure: {from: P2, unit: kPa}, gamma_deg: 30, gamma2_deg: -30}\n"
        "columns:\n  elongation_mm: {from: x_mm, unit: mm}\n  force_n: {from: F_N, unit: N}\n"
    )
    done = command(f"data.path={raw}", f"recipe={recipe}", f"out={tmp_path / 'my table.csv'}")
    assert done.status == 0, done.err
    lines = done.out.splitlines()
    following = [shlex.split(line)[1:] for line in lines[lines.index("next:") + 1 :]]
    assert [name for name, *_ in following] == ["train", "discover"]
    assert following[0][1:] == following[1][1:]
    assert "data.bed=isometric" in following[0]
    assert "my table_members.csv" in " ".join(following[0])
    # The search of loads that are no physics takes long, and reads the table with the same words.
    for (name, *words), result in list(zip(following, ("results.json", "discovery.json"), strict=True))[: 1 + EVERY]:
        folder = tmp_path / result
        # By day of a model that is fitted at once.
        quick = [] if EVERY else ["model=linear"]
        ran = commands.run(name, *words, *quick, "figures=false", f"hydra.run.dir={folder}", cwd=ROOT)
        assert ran.status == 0, ran.err
        assert (folder / result).exists()
