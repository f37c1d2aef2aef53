"""The commands as a user waits for them."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmark.common import ROOT, Report, timed

BARE = "import torch, lightning, hydra; from torch.utils.tensorboard import SummaryWriter"


def command(report: Report) -> None:
    """`python train.py`, beside the bare imports."""
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "train.py", "model=continuum", "train=sample3", f"hydra.run.dir={folder}/run"]
        ours = timed(lambda: subprocess.run(run, cwd=ROOT, check=True, capture_output=True), 3)
        bare = timed(lambda: subprocess.run([sys.executable, "-c", BARE], check=True), 3)
    report("python train.py model=continuum train=sample3", f"{ours:.1f} s", "")
    report(
        "  ours / bare import of torch, lightning, hydra, TensorBoard", f"{ours / bare:.2f} ×", "≤ 2 ×", f"{bare:.1f} s"
    )


def demo(report: Report) -> None:
    """What `make demo` runs, as the Makefile has it."""
    lines = (ROOT / "Makefile").read_text().split("demo: setup\n")[1].split("\n\n")[0].splitlines()
    with tempfile.TemporaryDirectory() as folder:
        for number, line in enumerate(lines):
            words = [word for word in line.replace("$(RUN)", "").split() if not word.startswith("hydra.run.dir")]
            run = [sys.executable, *words, f"hydra.run.dir={folder}/{number}"]
            began = time.perf_counter()
            subprocess.run(run, cwd=ROOT, check=True, capture_output=True)
            target = "≤ 20 s" if "discover" in words[0] else ""
            report(f"demo: {' '.join(words[:4])}", f"{time.perf_counter() - began:.1f} s", target)


def study(report: Report) -> None:
    """The paper's whole study, and its gathering."""
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "train.py", "-m", "experiment=study", f"hydra.sweep.dir={folder}/s", f"fits={folder}/f"]
        began = time.perf_counter()
        subprocess.run(run, cwd=ROOT, check=True, capture_output=True)
        report("the whole study, cold", f"{time.perf_counter() - began:.0f} s", "≤ 25 s", "410 cells, serial")
        _gather(report, Path(folder))


def _gather(report: Report, folder: Path) -> None:
    """Gathers copies of the study's jobs, as if of ten seeds."""
    import rich.console

    from freelearn.cli.gathering import gather_folders

    sweeps = []
    for seed in range(10):
        sweeps.append(folder / f"seed{seed}")
        for job in (folder / "s").glob("*/results.json"):
            place = sweeps[-1] / job.parent.name / "results.json"
            place.parent.mkdir(parents=True)
            place.write_text(json.dumps(json.loads(job.read_text()) | {"seed": seed}))
    quiet = rich.console.Console(quiet=True)
    seconds = {}
    for count in (1, 5, 10):
        began = time.perf_counter()
        gather_folders(sweeps[:count], folder / "out", quiet, "")
        seconds[count] = time.perf_counter() - began
    detail = ", ".join(f"{31 * count} jobs {s:.1f} s" for count, s in seconds.items())
    report("gathering 310 jobs", f"{seconds[10]:.1f} s", "≤ 3 s", detail)
    shutil.rmtree(folder / "out")


def memory(report: Report, jobs: int = 300) -> None:
    """A sweep of many seeds of one small fit, in one process: does memory grow with the jobs?"""
    code = f"""
import resource, sys, tempfile
from pathlib import Path
from freelearn.api.settings.configuration import composed
from freelearn.cli.sweep_job import sweep_job
with tempfile.TemporaryDirectory() as folder:
    for seed in range({jobs}):
        chosen = ["model=linear", "test=sample3", "figures=false", "fits=null", f"seed={{seed}}"]
        sweep_job(composed("train", chosen), seed, Path(folder) / str(seed), "")
        if seed in ({jobs} // 3, {jobs} - 1):
            now = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20
            print("resident", now, file=sys.stderr)
"""
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT).stderr
    early, late = (float(line.split()[1]) for line in out.splitlines() if line.startswith("resident"))
    report(f"memory after {jobs} jobs / after {jobs // 3}", f"{late / early:.2f} ×", "flat", f"{late:.0f} MiB")


def reports(report: Report) -> None:
    """Reports of a run and of a search over all eight samples."""
    from rich.console import Console

    from freelearn.api.settings.configuration import settings
    from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
    from freelearn.report.html import discovery_report as of_discovery
    from freelearn.report.html import run_report as of_run

    seconds = {}

    def watched(module: object, name: str) -> None:
        original = getattr(module, name)

        def call(*arguments: object) -> None:
            began = time.perf_counter()
            original(*arguments)
            seconds[name] = time.perf_counter() - began

        setattr(module, name, call)

    watched(of_run, "report_run")
    watched(of_discovery, "report_discovery")
    from freelearn.api.tasks.discover_task import discover
    from freelearn.api.tasks.train_task import train

    with tempfile.TemporaryDirectory() as folder:
        train(settings(TrainSettings, ["train=all", "fits=null"]), Path(folder) / "run")
        began = time.perf_counter()
        discover(settings(DiscoverSettings), Path(folder) / "search", Console(quiet=True))
        whole = time.perf_counter() - began
        for name, where in (("report_run", "run"), ("report_discovery", "search")):
            size = (Path(folder) / where / "report.html").stat().st_size / 2**20
            report(f"report.html of eight samples, {where}", f"{seconds[name]:.1f} s", "≤ 2 s", f"{size:.1f} MiB of 5")
    report("discovery of four hidden effects on eight samples, files and all", f"{whole:.0f} s", "≤ 60 s", "")


def peak() -> float:
    """Largest memory of this process so far [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
