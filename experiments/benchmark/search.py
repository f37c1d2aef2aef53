"""A discovery beside refitting every candidate with SciPy."""

from __future__ import annotations

import time

import numpy as np
import torch
from benchmark.common import ACCURACY, Report, rows_of, table
from scipy.optimize import least_squares

from freelearn.data.accuracy import Accuracy
from freelearn.discovery.fits.white_fit import WhiteProblem
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model

SAMPLES = (3, 6)


def discovery(report: Report) -> None:
    """Two samples, one hidden effect, the whole library; SciPy refits every candidate of one step once."""
    whole = table({"friction_hysteresis": {"force": 0.5, "moment": 0.01}})
    part = whole[whole["sample"].isin(SAMPLES)]
    rows = rows_of(part)

    def build(names: list[str]) -> Model:
        return build_model("continuum", {}, names, SAMPLES)

    question = question_of_rows(build, part.columns, rows, Accuracy.engineering(**ACCURACY), 0)
    began = time.perf_counter()
    findings = search(question)
    ours = time.perf_counter() - began
    base, began = findings.steps[0], time.perf_counter()
    for name in question.candidates:
        model = build([name])
        problem = WhiteProblem(model, rows, base.whiten)
        start = model.vector().detach().clone()
        start[: len(base.fit.vector)] = base.fit.vector
        lower, upper = (bound.numpy() for bound in model.raw_bounds())

        def residual(x: np.ndarray, problem: WhiteProblem = problem) -> np.ndarray:
            with torch.no_grad():
                return problem.residuals(torch.as_tensor(x)[None])[0].nan_to_num(nan=1e3).numpy()

        inside = np.clip(start.numpy(), lower + 1e-9, upper - 1e-9)
        least_squares(residual, inside, bounds=(lower, upper), x_scale="jac", max_nfev=50)
    peer = time.perf_counter() - began
    what = f"discovery on {len(rows)} rows: {findings.verdict}, {', '.join(findings.effects)}"
    report(what, f"{ours:.1f} s", "≤ 20 s", f"{len(question.candidates)} candidates")
    report("  SciPy refitting each candidate once / the whole discovery", f"{peer / ours:.1f} ×", "", f"{peer:.0f} s")
