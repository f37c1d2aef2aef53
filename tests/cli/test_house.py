"""The commands round the work: doctor, clean, completion."""

import gc
import os
import shutil
import subprocess
import sys
import time

import pytest

from freelearn.cli import completion, housekeeping
from freelearn.common.errors import UserError


def test_doctor_names_what_is_absent_and_how_to_get_it(monkeypatch, capsys):
    monkeypatch.setattr(housekeeping, "installed", lambda name: "" if name == "openpyxl" else "1.0")
    monkeypatch.setattr(sys, "argv", ["freelearn doctor"])
    housekeeping.doctor_main()
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "openpyxl" in line]
    assert "pip install 'freelearn[excel]'" in line


def made(folder, age, size):
    folder.mkdir(parents=True)
    (folder / "report.html").write_bytes(b"x" * size)
    then = time.time() - age * 86_400
    for path in (folder / "report.html", folder):
        os.utime(path, (then, then))


def test_clean_tells_first_and_deletes_old_days_only(tmp_path, capsys):
    made(tmp_path / "train" / "2020-01-01", 90, 2_000_000)
    made(tmp_path / "train" / "2026-01-01", 1, 10)
    made(tmp_path / "train" / "mine", 90, 10)
    elsewhere = tmp_path / "elsewhere"
    made(elsewhere, 90, 10)
    (tmp_path / "discover").mkdir()
    (tmp_path / "discover" / "2020-01-02").symlink_to(elsewhere)
    housekeeping.clean(tmp_path, 30)
    assert "2.0 MB" in capsys.readouterr().out
    assert (tmp_path / "train" / "2020-01-01").exists()
    housekeeping.clean(tmp_path, 30, yes=True)
    assert not (tmp_path / "train" / "2020-01-01").exists()
    for kept in ("train/2026-01-01", "train/mine", "elsewhere/report.html"):
        assert (tmp_path / kept).exists()
    with pytest.raises(UserError, match="no folder"):
        housekeeping.clean(tmp_path / "none", 30)


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
@pytest.mark.parametrize(
    ("line", "offers"),
    [("freelearn st", "start"), ("freelearn train model=con", "continuum"), ("freelearn plan ro", "rows=")],
)
def test_bash_completes(line, offers):
    script = completion.script("bash", ["start", "train", "plan"])
    words = line.replace("=", " = ").split()
    shell = f"""{script}
COMP_WORDS=({" ".join(words)}); COMP_CWORD={len(words) - 1}; COMP_LINE='{line}'; COMP_POINT={len(line)}
_freelearn; printf '%s\\n' "${{COMPREPLY[@]}}" """
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=True, timeout=20)
    assert offers in done.stdout.split()


def test_what_a_command_loads_is_seldom_looked_through_for_garbage():
    assert gc.get_threshold()[0] > 10_000
