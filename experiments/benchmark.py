"""`make bench`: every speed that the project promises, each beside its peer in the same run. Quote the ratios."""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
import textbook  # noqa: E402
from conftest import random_table  # noqa: E402
from numpy_peer import continuum as numpy_continuum  # noqa: E402

from freelearn.data.states import States, kinematic_state, measured_loads  # noqa: E402
from freelearn.data.virtual import simulate  # noqa: E402
from freelearn.fit.fit import FitOptions, fit  # noqa: E402
from freelearn.fit.problem import Problem, Rows  # noqa: E402
from freelearn.models.continuum import Continuum  # noqa: E402
from freelearn.models.mlp import MLP  # noqa: E402

BARE = "import torch, lightning, hydra; from torch.utils.tensorboard import SummaryWriter"
FIELDS = ("fiber_angle", "reference_length", "inner_radius", "outer_radius", "length", "twist", "pressure")


def timed(call: Callable[[], object], repeats: int = 5) -> float:
    """Median seconds of a call after one to warm up."""
    call()
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds)


def bed() -> Rows:
    """Training rows of sample 3 of the default virtual bed's physics without friction."""
    accuracy = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
    table = simulate(
        {"C1": 1e6, "C2": 4e7}, {"fiber_tension_only": {"share": 0.7}}, accuracy, buckled_share=0.45, seed=0
    )
    table = table[(table["sample"] == 3) & (table["buckled"] == 0)]
    return Rows(States.from_table(table), measured_loads(table), kinematic_state(table))


def forward(report: Callable[..., None]) -> None:
    table = random_table(20_000, 0)
    states = States.from_table(table)
    arrays = [getattr(states, name).numpy() for name in FIELDS]
    model = Continuum(2e5, 1e6)
    with torch.no_grad():
        ours = timed(lambda: model(states)) / len(states)
    peer = timed(lambda: numpy_continuum(*arrays, 2e5, 1e6), 3) / len(states)
    rows = [tuple(float(a[i]) for a in arrays) for i in range(12)]
    slow = timed(lambda: [textbook.continuum_row(*row, C1=2e5, C2=1e6) for row in rows], 1) / len(rows)
    report("continuum forward, 20,000 rows", f"{1e6 * ours:.2f} µs/row", "≤ 1 µs/row")
    report("  vectorised NumPy / ours", f"{peer / ours:.1f} ×", "≥ 8 ×", f"{1e6 * peer:.1f} µs/row")
    report("  textbook (quad + brentq) / ours", f"{slow / ours:.0f} ×", "≥ 1000 ×", f"{1e6 * slow:.0f} µs/row")


def fit_continuum(report: Callable[..., None]) -> None:
    rows = bed()
    arrays = [getattr(rows.states, name).numpy() for name in FIELDS]
    measured, scale = rows.loads.numpy(), Problem(Continuum(), rows).scale.numpy()
    none = rows[torch.zeros(0, dtype=torch.int64)]
    # Both stop at a tolerance of 1e-10, the default here.
    options = FitOptions("levenberg_marquardt", 1000, 1, 6, tolerance=1e-10)

    def ours() -> None:
        fit(Continuum(), rows, none, options, seed=0)

    def residual(x: np.ndarray) -> np.ndarray:
        loads = np.stack(numpy_continuum(*arrays, *np.exp(x)), axis=1)
        return np.nan_to_num((loads - measured) / scale, nan=1.0).ravel()

    def peer() -> None:
        least_squares(residual, np.log([1e5, 1e6]), x_scale="jac", **dict.fromkeys(("ftol", "xtol", "gtol"), 1e-10))

    a, b = timed(ours, 3), timed(peer, 3)
    report(f"fit C1, C2 on {len(rows)} rows", f"{1e3 * a:.0f} ms", "")
    report("  SciPy least_squares over NumPy / ours", f"{b / a:.1f} ×", "≥ 8 ×", f"{1e3 * b:.0f} ms")


def command(report: Callable[..., None]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "train.py", "model=continuum", "train=sample3", f"hydra.run.dir={folder}/run"]
        ours = timed(lambda: subprocess.run(run, cwd=ROOT, check=True, capture_output=True), 3)
        bare = timed(lambda: subprocess.run([sys.executable, "-c", BARE], check=True), 3)
    report("python train.py model=continuum train=sample3", f"{ours:.1f} s", "")
    report(
        "  ours / bare import of torch, lightning, hydra, TensorBoard", f"{ours / bare:.2f} ×", "≤ 2 ×", f"{bare:.1f} s"
    )


def network(report: Callable[..., None]) -> None:
    rows = bed()
    # The split is that of the command; both algorithms see the same rows and the same start.
    order = torch.randperm(len(rows), generator=torch.Generator().manual_seed(0))
    train, validation = rows[order[: int(0.8 * len(rows))]], rows[order[int(0.8 * len(rows)) :]]
    model = MLP()
    began = time.perf_counter()
    adam = fit(model, train, validation, FitOptions("adam", 1000, 1, 1000, learning_rate=0.02), seed=0)
    seconds = time.perf_counter() - began
    goal = min(held_out for _, _, held_out in adam.history)

    problem, held = None, None
    fresh = MLP()
    fresh.prepare(train.states, train.loads)
    from freelearn.fit.algorithm import LevenbergMarquardtEpochs

    began = time.perf_counter()
    problem = Problem(fresh, train)
    held = Problem(fresh, validation, problem.scale)
    start = fresh.starts(train.states, train.loads, 1, torch.Generator().manual_seed(0))
    lm = LevenbergMarquardtEpochs(problem, start, 1000, 1e-10)
    with torch.no_grad():
        error = float("inf")
        while error > goal and not bool(lm.finished.all()):
            lm.advance()
            error = float((held.residuals(lm.vectors).square().sum() / len(validation)).sqrt())
    ours = time.perf_counter() - began
    reached = f"reached in {lm.epochs} epochs" if error <= goal else f"NOT reached ({100 * error:.3f} %)"
    report(f"network, Adam's final error {100 * goal:.3f} %", f"{ours:.2f} s", "", reached)
    report("  Adam / Levenberg–Marquardt", f"{seconds / ours:.1f} ×", "≥ 10 ×", f"{seconds:.1f} s")


def large(report: Callable[..., None]) -> None:
    count = 10_000_000
    code = f"""
import resource, sys, time
sys.path.insert(0, {str(ROOT / "tests")!r})
import torch
from conftest import random_table
from freelearn.data.states import States
from freelearn.models.continuum import Continuum
model = Continuum(2e5, 1e6)
part = States.from_table(random_table({count // 100}, 0))
states = States(**{{n: getattr(part, n).repeat(100) for n in part.__dataclass_fields__}})
began = time.perf_counter()
with torch.no_grad():
    loads, status = model(states)
print(len(loads), time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
"""
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    report(
        f"{int(out[0]):,} rows predicted, peak memory", f"{float(out[2]):.2f} GiB", "≤ 4 GiB", f"{float(out[1]):.0f} s"
    )


def main() -> None:
    torch.set_num_threads(2)
    console = Console()
    table = Table(title=f"freelearn benchmarks, {torch.get_num_threads()} threads")
    for heading in ("what", "measured", "target", "detail"):
        table.add_column(heading)

    def report(what: str, measured: str, target: str, detail: str = "") -> None:
        table.add_row(what, measured, target, detail)
        console.print(f"{what}: {measured} {f'(target {target})' if target else ''} {detail}", highlight=False)

    for benchmark in (forward, fit_continuum, command, network, large):
        benchmark(report)
    console.print(table)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    console.print(f"peak memory of this process {peak:.2f} GiB")


if __name__ == "__main__":
    main()
