"""Fits beside SciPy's."""

from __future__ import annotations

import time

import numpy as np
import torch
from benchmark.common import FIELDS, Report, bed, rows_of, table, timed
from scipy.optimize import least_squares

from freelearn.data.rows import Rows
from freelearn.data.sets import samples_of, set_names, split_rows
from freelearn.fitting.algorithm import LevenbergMarquardtEpochs
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.mlp import MLP, inputs
from freelearn.testing.reference.numpy_peer import continuum as numpy_continuum
from freelearn.testing.reference.numpy_peer import linear as numpy_linear
from freelearn.testing.reference.numpy_peer import network as numpy_network

LM = FitOptions("levenberg_marquardt", 1000, 1, 6, tolerance=1e-10)
TOLERANCES = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-10)


def fit_continuum(report: Report) -> None:
    """One fit of C1 and C2, beside SciPy's."""
    rows = bed()
    arrays = [getattr(rows.states, name).numpy() for name in FIELDS]
    measured, scale = rows.loads.numpy(), Problem(Continuum(), rows).scale.numpy()
    none = rows[torch.zeros(0, dtype=torch.int64)]

    def ours() -> None:
        fit(Continuum(), rows, none, LM, seed=0)

    def residual(x: np.ndarray) -> np.ndarray:
        loads = np.stack(numpy_continuum(*arrays, *np.exp(x)), axis=1)
        return np.nan_to_num((loads - measured) / scale, nan=1.0).ravel()

    def peer() -> None:
        least_squares(residual, np.log([1e5, 1e6]), x_scale="jac", **TOLERANCES)

    a, b = timed(ours, 3), timed(peer, 3)
    report(f"fit C1, C2 on {len(rows)} rows", f"{1e3 * a:.0f} ms", "")
    report("  SciPy least_squares over NumPy / ours", f"{b / a:.1f} ×", "≥ 1 ×", f"{1e3 * b:.0f} ms")


def study(report: Report) -> None:
    """The study's thirty fits: three models on ten training sets."""
    # What the first fit of a process pays, such as imports, is no part of a fit.
    fit(build_model("linear"), bed(), bed()[torch.zeros(0, dtype=torch.int64)], LM, seed=0)
    whole = table()
    sample = whole["sample"].to_numpy()
    label = split_rows(whole, 0, False)
    sets = {}
    for name in set_names(sample):
        inside = np.isin(sample, samples_of(name, sample))
        sets[name] = rows_of(whole[inside & (label == "train")]), rows_of(whole[inside & (label == "validation")])
    ours, peers = dict.fromkeys(("continuum", "linear", "mlp"), 0.0), dict.fromkeys(("continuum", "linear", "mlp"), 0.0)
    for training, validation in sets.values():
        for name in ours:
            began = time.perf_counter()
            watched = validation if name == "mlp" else validation[torch.zeros(0, dtype=torch.int64)]
            fit(build_model(name), training, watched, LM, seed=0)
            ours[name] += time.perf_counter() - began
            began = time.perf_counter()
            _scipy(name, training)
            peers[name] += time.perf_counter() - began
    for name in ours:
        detail = f"{ours[name]:.1f} s against {peers[name]:.1f} s"
        target = "≥ 1 ×" if name == "continuum" else ""
        report(f"ten fits of {name}: SciPy over NumPy / ours", f"{peers[name] / ours[name]:.1f} ×", target, detail)
    report("the study's 30 fits: SciPy / ours", f"{sum(peers.values()) / sum(ours.values()):.1f} ×", "", "both serial")


def _scipy(name: str, rows: Rows) -> None:
    """SciPy's own trust region over the NumPy peer, derivatives by difference quotients, from one start."""
    a = {field: getattr(rows.states, field).numpy() for field in FIELDS}
    measured, scale = rows.loads.numpy(), rows.loads.abs().amax(0).numpy()
    x = inputs(rows.states).numpy()
    low, high = x.min(0), x.max(0)
    x = 2 * (x - low) / np.where(high > low, high - low, 1) - 1

    def residual(p: np.ndarray) -> np.ndarray:
        if name == "mlp":
            loads = numpy_network(x, p) * scale
        elif name == "linear":
            names = ("fiber_angle", "reference_length", "outer_radius", "length", "twist", "pressure")
            loads = np.stack(numpy_linear(*(a[n] for n in names), *p), axis=1)
        else:
            loads = np.stack(numpy_continuum(*a.values(), *np.exp(p)), axis=1)
        return np.nan_to_num((loads - measured) / scale, nan=1.0).ravel()

    start = {
        "mlp": np.random.default_rng(0).normal(0, 0.5, 62),
        "linear": np.array([1e3, 0.1, 0.0]),
        "continuum": np.log([1e5, 1e6]),
    }[name]
    # As many evaluations as ours has epochs at most; a network would otherwise go on for thousands.
    least_squares(residual, start, x_scale="jac", max_nfev=1000 if name != "mlp" else 100, **TOLERANCES)


def network(report: Report) -> None:
    """Levenberg-Marquardt to the error that Adam ends at."""
    rows = bed()
    # The split is that of the command; both algorithms see the same rows and the same start.
    order = torch.randperm(len(rows), generator=torch.Generator().manual_seed(0))
    train, validation = rows[order[: int(0.8 * len(rows))]], rows[order[int(0.8 * len(rows)) :]]
    model = MLP()
    began = time.perf_counter()
    adam = fit(model, train, validation, FitOptions("adam", 1000, 1, 1000, learning_rate=0.02), seed=0)
    seconds = time.perf_counter() - began
    goal = min(error for _, _, error in adam.history)

    fresh = MLP()
    fresh.prepare(train)
    began = time.perf_counter()
    problem = Problem(fresh, train)
    watched = Problem(fresh, validation, problem.scale)
    start = starts(fresh, train, 1, torch.Generator().manual_seed(0))
    lm = LevenbergMarquardtEpochs(problem, start, 1000, 1e-10)
    with torch.no_grad():
        error = float("inf")
        while error > goal and not bool(lm.finished.all()):
            lm.advance()
            error = float((watched.residuals(lm.vectors).square().sum() / len(validation)).sqrt())
    ours = time.perf_counter() - began
    reached = f"reached in {lm.epochs} epochs" if error <= goal else f"NOT reached ({100 * error:.3f} %)"
    report(f"network, Adam's final error {100 * goal:.3f} %", f"{ours:.2f} s", "", reached)
    report("  Adam / Levenberg–Marquardt", f"{seconds / ours:.1f} ×", "≥ 10 ×", f"{seconds:.1f} s")
