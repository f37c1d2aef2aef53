"""The models' own speed."""

from __future__ import annotations

import subprocess
import sys

import torch
from benchmark.common import FIELDS, Report, timed

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.fitting.problem import Problem
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.reference import textbook
from freelearn.testing.reference.numpy_peer import continuum as numpy_continuum
from freelearn.testing.reference.numpy_peer import continuum_plain
from freelearn.testing.small_tables import random_table

FIVE = ["wall_stiffening", "end_clamps", "twist_offset", "friction_hysteresis", "sensor_crosstalk"]


def forward(report: Report) -> None:
    """The continuum's forward pass."""
    table = random_table(20_000, 0)
    states = States.from_table(table)
    arrays = [getattr(states, name).numpy() for name in FIELDS]
    model = Continuum(2e5, 1e6)
    with torch.no_grad():
        ours = timed(lambda: model(states)) / len(states)
    peer = timed(lambda: numpy_continuum(*arrays, 2e5, 1e6), 3) / len(states)
    plain = timed(lambda: continuum_plain(*arrays, 2e5, 1e6), 3) / len(states)
    rows = [tuple(float(a[i]) for a in arrays) for i in range(12)]
    slow = timed(lambda: [textbook.continuum_row(*row, C1=2e5, C2=1e6) for row in rows], 1) / len(rows)
    report("continuum forward, 20,000 rows", f"{1e6 * ours:.2f} µs/row", "≤ 0.5 µs/row")
    report(
        "  vectorized NumPy, equations as typed / ours", f"{plain / ours:.1f} ×", "≥ 8 ×", f"{1e6 * plain:.1f} µs/row"
    )
    report("  NumPy specialized for this energy / ours", f"{peer / ours:.1f} ×", "", f"{1e6 * peer:.2f} µs/row")
    report("  textbook (quad + brentq) / ours", f"{slow / ours:.0f} ×", "≥ 1000 ×", f"{1e6 * slow:.0f} µs/row")


def effects(report: Report) -> None:
    """The forward pass and the Jacobian with five effects."""
    states = States.from_table(random_table(20_000, 0))
    plain, five = Continuum(2e5, 1e6), build_model("continuum", {"C1": 2e5, "C2": 1e6}, FIVE)
    with torch.no_grad():
        a, b = timed(lambda: plain(states)), timed(lambda: five(states))
    report("five effects / plain model, forward", f"{b / a:.1f} ×", "≤ 3 ×", ", ".join(FIVE))
    rows = Rows.whole(states, torch.ones(len(states), 2).double())
    vector = five.vector().detach()[None]
    jacobian = timed(lambda: Problem(five, rows).jacobians(vector), 3)
    count = vector.shape[1]
    report("  Jacobian by all parameters / forward", f"{jacobian / b:.1f} ×", f"≤ {count + 2} ×", f"{count} parameters")


def large(report: Report) -> None:
    """Ten million rows, predicted block by block."""
    count = 10_000_000
    code = f"""
import resource, sys, time
import torch
from freelearn.testing.small_tables import random_table
from freelearn.data.states import States
from freelearn.physics.models.continuum import Continuum
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
