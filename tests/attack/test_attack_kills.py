"""kill -9 at seeded moments of every command: what is there is whole, and the same command ends as if undisturbed."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import pytest
from attack_kills import ARM, contents, differing, events, leftovers
from closed_forms import SHORT, synthetic
from conftest import ROOT
from forked_commands import Commands
from hidden_tables import FEW, among, table
from nightly import EVERY, chosen
from small_runs import make_csv

pytestmark = pytest.mark.slow

RAW = "Zeit;s_m;w_rad;P_bar;F_raw_N;M_raw_Nm\n" + "".join(
    f"{i};{e};{w};{p};{0.01 * i - 900 * e - 2.5 * p:.4f};{-0.05 * p - 0.02 * w:.6f}\n".replace(".", ",")
    for i, (e, w, p) in enumerate((e, w, p) for e in (0.0, 0.002) for w in (0.0, 0.5) for p in (0.0, 0.3, 0.6))
)
RECIPE = """\
bed: kinematic
constants: {gamma_deg: 60, length_mm: 90, inner_radius_mm: 4.77, outer_radius_mm: 6.35}
columns:
  elongation_mm: {from: s_m, unit: m}
  twist_deg: {from: w_rad, unit: rad}
  pressure_kpa: {from: P_bar, unit: bar}
  force_n: {from: F_raw_N, unit: N}
  moment_nmm: {from: M_raw_Nm, unit: N m}
"""


class Attacked:
    """A folder in which commands are killed. Each command writes to `out` alone, the same path every time, so that
    whatever of a path gets into a file is the same too."""

    def __init__(self, folder: Path, commands: Commands) -> None:
        self.folder, self.commands, self.out = folder, commands, folder / "out"
        self.known: dict[str, tuple[dict, int]] = {}

    @cached_property
    def measured(self) -> list[str]:
        make_csv(self.folder / "measured.csv", rows=160)
        return ["data=csv", f"data.path={self.folder / 'measured.csv'}", "figures=false"]

    @cached_property
    def hidden(self) -> list[str]:
        table({"length_compliance": {"compliance": 2e-5}}, samples=(3,), share=0.05).to_csv(
            self.folder / "hidden.csv", index=False
        )
        return ["data=csv", f"data.path={self.folder / 'hidden.csv'}", "figures=false"]

    @cached_property
    def fitted(self) -> Path:
        folder = self.folder / "fitted"
        self._made("train", *self.measured, "train=all", "fits=null", f"hydra.run.dir={folder}")
        return folder

    @cached_property
    def swept(self) -> Path:
        folder = self.folder / "swept"
        self._made(*SWEEP, *self.measured, "fits=null", f"hydra.sweep.dir={folder}")
        return folder

    @cached_property
    def questions(self) -> Path:
        path = self.folder / "questions.csv"
        path.write_text(
            "sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm\n"
            "3,1,10,40,,\n3,,,50,0,0\n6,0,20,,5,\n6,2,-30,30,,\n"
        )
        return path

    @cached_property
    def raw(self) -> list[str]:
        (self.folder / "raw.csv").write_text(RAW)
        (self.folder / "recipe.yaml").write_text(RECIPE)
        return [f"data.path={self.folder / 'raw.csv'}"]

    @cached_property
    def specimens(self) -> list[str]:
        words = []
        for mode, rows in synthetic(3e5, 8e3).groupby("mode"):
            rows[["stretch", "stress_mpa"]].to_csv(self.folder / f"{mode}.csv", index=False)
            words.append(f"{SHORT[mode]}={self.folder / mode}.csv")
        return words

    def _made(self, *words: str) -> None:
        ended = self.commands.run(*words)
        assert ended.status == 0, ended.told

    def undisturbed(self, name: str) -> tuple[dict, int]:
        """What the command leaves, and how many operations on files that takes."""
        if name not in self.known:
            self.fresh()
            count = self.folder / "count"
            ended = self.commands.run(*COMMANDS[name](self), KILL_UNDER=str(self.out), KILL_COUNT=str(count))
            assert ended.status == 0, ended.told
            assert not leftovers(self.out)
            self.known[name] = contents(self.out), int(count.read_text())
        return self.known[name]

    def fresh(self) -> None:
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()


SWEEP = ["train", "-m", "model=linear,continuum", "train=all"]
COMMANDS: dict[str, Callable[[Attacked], list[str]]] = {
    "train": lambda a: [
        "train", *a.measured, "train=all", "effects=[force_offset]", f"fits={a.out}/fits", f"hydra.run.dir={a.out}/run",
    ],
    "sweep": lambda a: [*SWEEP, *a.measured, f"fits={a.out}/fits", f"hydra.sweep.dir={a.out}/sweep"],
    "discover": lambda a: ["discover", *a.hidden, among(*(FEW if EVERY else ("force_offset",)), "length_compliance"),
                           f"hydra.run.dir={a.out}/run"],
    "predict": lambda a: ["predict", f"run={a.fitted}", f"data.path={a.questions}", f"hydra.run.dir={a.out}/run"],
    "plan": lambda a: [
        "plan", f"run={a.fitted}", "rows=4", "goal=narrow", "parameter=C1", "figures=false",
        f"hydra.run.dir={a.out}/run",
    ],
    "gather": lambda a: ["gather", str(a.swept), "--out", f"{a.out}/gathered"],
    "figures": lambda a: ["figures", str(a.swept), "--out", f"{a.out}/figures", "--no-bands"],
    "draft": lambda a: ["intake", *a.raw, f"hydra.run.dir={a.out}/run"],
    "intake": lambda a: ["intake", *a.raw, f"recipe={a.folder / 'recipe.yaml'}", f"hydra.run.dir={a.out}/run"],
    "specimens": lambda a: ["specimens", *a.specimens, "--effects", "wall_stiffening", "--out", f"{a.out}/specimen"],
}  # fmt: skip
# How often each command is killed: every time, and in the usual tests.
MOMENTS = {
    "train": (8, 1), "sweep": (8, 0), "discover": (10, 1), "predict": (4, 0), "plan": (4, 1), "gather": (5, 0),
    "figures": (3, 0), "draft": (2, 0), "intake": (5, 1), "specimens": (4, 0),
}  # fmt: skip
KILLS = [
    (name, number)
    for name, (most, usually) in MOMENTS.items()
    for number in (range(most) if EVERY else chosen(range(most), usually, seed=len(name)))
]


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kills")
    with Commands(folder, ARM) as commands:
        yield Attacked(folder, commands)


@pytest.mark.parametrize(("name", "number"), KILLS)
def test_a_killed_command_leaves_whole_files_and_then_ends_as_if_undisturbed(name, number, attacked):
    whole, count = attacked.undisturbed(name)
    attacked.fresh()
    # Evenly spread, and seeded within each part: early and late moments are among them.
    most = MOMENTS[name][0]
    at = 1 + int(count * (number + random.Random(f"{name} {number}").random()) / most)
    words = COMMANDS[name](attacked)
    killed = attacked.commands.run(*words, KILL_UNDER=str(attacked.out), KILL_AT=str(min(at, count)))
    assert killed.status == -signal.SIGKILL, killed.told
    for place, told in contents(attacked.out).items():
        # Hydra writes its notes itself; nothing reads them. What is hidden is unfinished, and nobody's.
        if not any(part.startswith(".") for part in Path(place).parts) and not place.endswith("progress.json"):
            assert told == whole[place], f"{place} after a kill at {at} of {count}"
    again = attacked.commands.run(*words)
    assert again.status == 0, again.told
    now = contents(attacked.out)
    assert differing(whole, now) == []
    assert leftovers(attacked.out) == []
    assert all(n == 1 for n in events(attacked.out).values()), events(attacked.out)


def workers(folder: Path) -> list[int]:
    """Processes that work in a folder's sweep, besides its own."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            command = (process / "cmdline").read_bytes() if process.name.isdigit() else b""
            if b"joblib" in command and f"ATTACK={folder}".encode() in (process / "environ").read_bytes():
                found.append(int(process.name))
        except OSError:
            pass  # it has ended
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
@pytest.mark.parametrize("results", [0, 1, 2] if EVERY else [1])
@pytest.mark.nightly
def test_a_killed_sweep_on_several_cores_leaves_no_worker_and_then_ends_as_if_undisturbed(results, attacked):
    # More workers than jobs: one that was given nothing to do has to notice too.
    words = [*COMMANDS["sweep"](attacked), "hydra/launcher=joblib", "hydra.launcher.n_jobs=3"]
    whole, _ = attacked.undisturbed("sweep")
    attacked.fresh()
    line = [sys.executable, "-m", "freelearn", *words]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), "ATTACK": str(attacked.out)}
    # A report says how it is made again: by the command's name where the shell finds it, as in the undisturbed ones.
    env["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), env.get("PATH", "")])
    sweep = subprocess.Popen(line, cwd=attacked.folder, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    sweep_folder, deadline = attacked.out / "sweep", time.monotonic() + 300
    while not (len(workers(attacked.out)) > 3 and len(list(sweep_folder.glob("*/results.json"))) >= results):
        assert time.monotonic() < deadline
        assert sweep.poll() is None
        time.sleep(0.05)
    sweep.kill()
    sweep.wait()
    killed = time.monotonic()
    while left := workers(attacked.out):
        assert time.monotonic() < killed + 10, left
        time.sleep(0.1)
    again = attacked.commands.run(*COMMANDS["sweep"](attacked))
    assert again.status == 0, again.told
    now = contents(attacked.out)
    # Which launcher it was stands in Hydra's notes alone.
    assert [place for place in differing(whole, now) if ".hydra/" not in place] == []
    assert leftovers(attacked.out) == []


@pytest.mark.nightly
def test_one_kept_of_two_runs_in_one_folder_is_never_mixed_with_the_other(attacked):
    """Killed while it replaces an earlier run's files, a run leaves a folder that says so, or a whole one."""
    attacked.fresh()
    folder = attacked.out / "run"
    line = ["train", *attacked.measured, "train=all", "fits=null", f"hydra.run.dir={folder}"]
    first = attacked.commands.run(*line, "model=linear")
    assert first.status == 0, first.told
    ask = ["predict", f"run={folder}", f"data.path={attacked.questions}"]
    answers = {}
    for model in ("linear", "continuum"):
        assert attacked.commands.run(*line, f"model={model}").status == 0
        assert attacked.commands.run(*ask, f"hydra.run.dir={attacked.out}/{model}").status == 0
        answers[(attacked.out / model / "answers.csv").read_bytes()] = model
    assert len(answers) == 2
    count = int(attacked.undisturbed("train")[1])
    for at in chosen(range(3, count, 4), 4, seed=1):
        attacked.fresh()
        assert attacked.commands.run(*line, "model=linear").status == 0
        attacked.commands.run(*line, "model=continuum", KILL_UNDER=str(attacked.out), KILL_AT=str(at))
        asked = attacked.commands.run(*ask, f"hydra.run.dir={attacked.out}/asked")
        if asked.status == 0:
            assert (attacked.out / "asked" / "answers.csv").read_bytes() in answers
        else:
            assert "Traceback" not in asked.err
            assert asked.err.startswith("error: ")


@pytest.mark.nightly
def test_a_damaged_progress_of_a_search_leads_to_the_same_result(attacked):
    whole, count = attacked.undisturbed("discover")
    words = COMMANDS["discover"](attacked)
    attacked.fresh()
    killed = attacked.commands.run(*words, KILL_UNDER=str(attacked.out), KILL_AT=str(2 * count // 3))
    assert killed.status == -signal.SIGKILL
    progress = attacked.out / "run" / "progress.json"
    content = progress.read_bytes()
    assert json.loads(content)["fits"]
    generator = random.Random(0)
    for k in chosen(range(12), 2, seed=2):
        at = generator.randrange(len(content)) if k else 0
        damaged = bytearray(content)
        damaged[at] ^= 1 << generator.randrange(7)
        progress.parent.mkdir(exist_ok=True)
        progress.write_bytes(damaged if k % 3 else content[:at])
        again = attacked.commands.run(*words)
        assert again.status == 0, again.told
        assert differing(whole, contents(attacked.out)) == []
