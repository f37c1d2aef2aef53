"""One call of an exported actuator: C beside onnxruntime and torch."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
import torch
from benchmark.common import ROOT, Report

import freelearn
from freelearn.data.states import States
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.writers.c_file import compiler
from freelearn.export.writers.onnx_file import answered, opened
from freelearn.physics.models.build import build_model
from freelearn.testing.small_tables import recordings

EFFECTS = {
    "three effects": "[end_clamps,friction_hysteresis,force_gain]",
    "three effects, one of them a strain energy": "[wall_stiffening,friction_hysteresis,force_gain]",
}
HISTORY = ["supply_lag", "creep", "maxwell_slip"]
CALLS = 300_000
# Calls at 1024 states in turn; the sum keeps a compiler from leaving them out.
MAIN = """
#include <stdio.h>
#include <time.h>
int arm_loads(const double in[{inputs}], double out[{outputs}]);
int main(void) {{
    double in[{inputs}] = {{0}}, out[{outputs}], sum = 0.0;
    const clock_t began = clock();
    for (int i = 0; i < {calls}; i++) {{
        in[0] = -0.004 + 0.008 * (i % 32) / 31.0;
        in[1] = -1.5 + 3.0 * (i / 32 % 32) / 31.0;
        in[2] = 60000.0 * (i % 7) / 6.0;
        arm_loads(in, out);
        sum += out[0];
    }}
    printf("%.9g %.9g\\n", (double)(clock() - began) / CLOCKS_PER_SEC / {calls}, sum);
    return 0;
}}
"""
# The same of a log, a hundredth of a second from sample to sample.
STEPS = """
#include <stdio.h>
#include <time.h>
void arm_reset(double state[{states}]);
int arm_step(const double in[3], double dt, double state[{states}], double out[4]);
int main(void) {{
    double in[3] = {{0}}, out[4], state[{states}], sum = 0.0;
    arm_reset(state);
    const clock_t began = clock();
    for (int i = 0; i < {calls}; i++) {{
        in[0] = -0.004 + 0.008 * (i % 32) / 31.0;
        in[1] = -1.5 + 3.0 * (i / 32 % 32) / 31.0;
        in[2] = 60000.0 * (i % 7) / 6.0;
        arm_step(in, 0.01, state, out);
        sum += out[0];
    }}
    printf("%.9g %.9g\\n", (double)(clock() - began) / CLOCKS_PER_SEC / {calls}, sum);
    return 0;
}}
"""


def exported(report: Report) -> None:
    """Processor time of one call: of the C in a loop of its own, of onnxruntime and torch from Python."""
    for what, effects in EFFECTS.items():
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            words = [f"effects={effects}", "train=sample3", "figures=false", f"hydra.run.dir={folder / 'run'}"]
            subprocess.run([sys.executable, "train.py", *words], cwd=ROOT, check=True, capture_output=True)
            run = freelearn.load(folder / "run")
            run.export(folder / "onnx" / "arm.onnx", force=True)
            run.export(folder / "arm.c", force=True)
            actuator = Actuator.from_fitted(run)
            loads = Functions(actuator).view.answer
            own = _in_c(folder, MAIN.format(inputs=len(loads.inputs), outputs=len(loads.outputs), calls=CALLS))
            session, row = opened(folder / "onnx" / "arm.onnx"), np.zeros((1, len(loads.inputs)))
            row[0, :3] = 1e-3, 0.3, 3e4
            onnx = _each(partial(answered, session, loads, row), 200)
            x = torch.as_tensor(row[:, :3].copy()) + actuator.rest
            model = _each(partial(actuator.system.at, x), 50)
        detail = f"{loads.operations} operations; onnxruntime {1e6 * onnx:.0f} µs, torch {1e6 * model:.0f} µs"
        report(f"C, a call of the continuum model with {what}", f"{1e6 * own:.2f} µs", "≤ 2 µs", detail)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = build_model("continuum", {}, HISTORY)
        with torch.no_grad():
            shown = model(States.from_table(recordings((3,)))).loads.numpy()
        log = recordings((3,)).assign(force_n=shown[:, 0], moment_nmm=1e3 * shown[:, 1], buckled=0)
        run = freelearn.fit(log, effects=HISTORY, fit="none")
        run.export(folder / "arm.c", force=True)
        step = Functions(Actuator.from_fitted(run)).step
        assert step is not None
        own = _in_c(folder, STEPS.format(states=step.carried, calls=CALLS))
    detail = f"{step.operations} operations, a state of {step.carried} numbers"
    report("C, a sample of a log by the continuum model with three effects of the history", f"{1e6 * own:.2f} µs",
           "≤ 2 µs", detail)  # fmt: skip


def _in_c(folder: Path, main: str) -> float:
    """Processor time of a call, as a program that calls folder/arm.c prints it first, s."""
    (folder / "main.c").write_text(main, encoding="utf-8")
    command = [str(compiler()), "-std=c99", "-O2", "-o", "arm", "arm.c", "main.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run([str(folder / "arm")], check=True, capture_output=True, text=True)
    return float(done.stdout.split()[0])


def _each(call: object, calls: int) -> float:
    """Processor time of one call, after one to warm up."""
    assert callable(call)
    call()
    began = time.process_time()
    for _ in range(calls):
        call()
    return (time.process_time() - began) / calls
