"""A log of a million samples: forward, with derivatives, its memory; and the fit of a hundred thousand.

Seconds are the processor's, of one thread: what else the machine does hardly counts.
"""

from __future__ import annotations

import multiprocessing
import resource
import time

import numpy as np
import pandas as pd
import torch
from benchmark.common import Report

from freelearn.data.rows import Rows
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import DESIGNS

MANY, FITTED, RECORDINGS, RATE = 1_000_000, 100_000, 10, 100.0
# Eight parameters with C1 and C2.
EFFECTS = {
    "maxwell_slip": {"share": 0.2, "force": 2.0, "moment": 0.01, "asymmetry": 0.0},
    "creep": {"share": 0.2, "time": 3.0},
}
GIB = 2.0**20


def long_logs(report: Report) -> None:
    """All of them, each in a process of its own, whose peak memory it tells."""
    context = multiprocessing.get_context("spawn")
    for what, target, measure in (
        (f"log of {MANY:,} samples, forward", "≤ 1 s", _forward),
        (f"log of {MANY:,} samples, derivatives of 8 parameters", "≤ 6 s, ≤ 4 GiB", _derivatives),
        (f"log of {FITTED:,} samples, fit of 8 parameters", "≤ 10 s", _fit),
    ):
        with context.Pool(1) as pool:
            seconds, peak, words = pool.apply(measure)
        report(what, f"{seconds:.2f} s", target, f"{peak:.1f} GiB at most in its process{words}")


def _made(count: int) -> tuple[Model, Rows]:
    """Slips and creep along recordings in which pressure, length and twist go up and down, with a reading's noise."""
    torch.set_num_threads(1)
    time_s = np.tile(np.arange(count // RECORDINGS) / RATE, RECORDINGS)
    run = np.repeat(np.arange(RECORDINGS), count // RECORDINGS)
    phase, design = run / RECORDINGS * 2 * np.pi, DESIGNS[3]
    columns = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    table = pd.DataFrame(
        {
            "sample": 4, **dict(zip(columns, design, strict=True)), "step": np.arange(count), "buckled": 0,
            "elongation_mm": 3 * np.sin(phase), "twist_deg": 60 * np.cos(phase), "time_s": time_s, "run": run,
            "pressure_kpa": 35 - 20 * np.cos(0.5 * time_s + phase) - 14 * np.cos(1.3 * time_s),
            "force_n": 0.0, "moment_nmm": 0.0,
        }
    )  # fmt: skip
    model = build_model("continuum", {"C1": 1e6, "C2": 4e7}, list(EFFECTS))
    model.set_values({f"{name}.{p}": value for name, own in EFFECTS.items() for p, value in own.items()})
    rows = Rows.from_table(table)
    with torch.no_grad():
        loads = model(rows.states).loads.numpy()
    generator = np.random.default_rng(0)
    read = loads + generator.normal(size=loads.shape) * (0.03, 6e-4)
    return model, Rows.from_table(table.assign(force_n=read[:, 0], moment_nmm=1e3 * read[:, 1]))


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / GIB


def _forward() -> tuple[float, float, str]:
    model, rows = _made(MANY)
    began = time.process_time()
    with torch.no_grad():
        model(rows.states)
    return time.process_time() - began, _peak(), ""


def _derivatives() -> tuple[float, float, str]:
    model, rows = _made(MANY)
    problem, vector = Problem(model, rows), model.vector().detach()[None]
    began = time.process_time()
    problem.jacobians(vector)
    return time.process_time() - began, _peak(), ""


def _fit() -> tuple[float, float, str]:
    model, rows = _made(FITTED)
    begun = build_model("continuum", effects=list(EFFECTS))
    began = time.process_time()
    fit(begun, rows, rows[torch.arange(0)], FitOptions("levenberg_marquardt", max_epochs=60, restarts=1, patience=6), 0)
    seconds = time.process_time() - began
    truth, found = model.scalars(), begun.scalars()
    worst = max(abs(found[name] / value - 1) for name, value in truth.items() if value)
    return seconds, _peak(), f"; no parameter farther off than {worst:.1%}"
