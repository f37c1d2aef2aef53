"""A mistyped path or option is told before what takes seconds to import, by every command that takes one."""

import subprocess
import sys

import pytest

# What a table, a model or a workbook needs; each takes a good part of a second to import.
SLOW = ("pandas", "torch", "pint", "scipy")
COMMANDS = {
    "start": (["start", "none.csv"], "There is no file none.csv, nor any other .csv file in this folder."),
    "start --recipe": (["start", "raw.txt", "--recipe", "none.yaml"], "There is no file none.yaml"),
    "start --run": (["start", "raw.txt", "--run", "none"], "No folder at none"),
    "intake": (["intake", "data.path=none.csv"], "There is no file none.csv"),
    "intake recipe": (["intake", "data.path=raw.txt", "recipe=none.yaml"], "There is no file none.yaml"),
    "predict": (["predict", "run=none", "data.path=raw.txt"], "No folder at none"),
    "predict data.path": (["predict", "run=.", "data.path=none.csv"], "There is no file none.csv"),
    "plan": (["plan", "run=none"], "No folder at none"),
    "referee": (["referee", "run=none"], "No folder at none"),
    "export": (["export", "run=none", "to=c"], "No folder at none"),
    "an option": (
        ["train", "effectss=[end_clamps]"],
        "Unknown option 'effectss'. Did you mean 'effects'? Known: model, ",
    ),
    "a nested one": (["train", "fit.tolerancee=1"], "Unknown option 'fit.tolerancee'. Did you mean 'fit.tolerance'?"),
    "a folder": (["export", "run=.", "to=c", "out=there"], "Unknown option 'out'. Known: run, "),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_mistake_is_told_at_once(name, tmp_path):
    words, says = COMMANDS[name]
    (tmp_path / "raw.txt").write_text("a\n1\n")
    code = f"""
import atexit, sys
atexit.register(lambda: print([m for m in {SLOW} if m in sys.modules]))
sys.argv = ["freelearn", *{words}]
from freelearn.__main__ import main
main()"""
    line = [sys.executable, "-c", code]
    done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith(f"error: {says}")
    assert done.stdout.strip() == "[]"
    assert [path.name for path in tmp_path.iterdir()] == ["raw.txt"]
