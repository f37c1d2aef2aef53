"""Logs beside their peers on the same recordings that were left out, run freely: cubics, plays and creep, NARX, ours.

The measured logs (../shared/data, or FREELEARN_SHARED_DATA) are not ours to ship; where they are absent the simulated
ones of `stand_ins` remain.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import festo_logs
import numpy as np
import pandas as pd
import torch
from benchmark.common import ROOT, Report
from benchmark.narx import Array, Narx, whole
from benchmark.stand_ins import stand_ins
from free_block import BUILT, BUILT_EACH, START

from freelearn.data.beds import BED, DEAD_LOAD
from freelearn.data.columns import with_members
from freelearn.data.rows import Rows
from freelearn.data.table.log_tables import thinned
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS

DATA = Path(os.environ.get("FREELEARN_SHARED_DATA", ROOT.parent / "shared/data")) / "time"
FESTO, BLOCK = DATA / "festo_10mm_log", DATA / "end_block_log" / "log.csv"

# The free block, thinned. Every third sweep of the third pressure is left out; a NARX model needs stretches of so many
# rows with a pose. A marker lower than this has jumped [m].
RATE, SWEEP, OUT, STRETCH, JUMPED = 2.0, 9, 3, 8, -8e-3
MEMBERS = pd.DataFrame(
    {
        "member": [1, 2, 3], "gamma_deg": [15.0, -15.0, 52.77], "gamma2_deg": np.nan, "length_mm": 160.0,
        "inner_radius_mm": 4.77, "outer_radius_mm": 6.35,
    }
)  # fmt: skip
PRESSURES = [f"pressure_{i}_kpa" for i in (1, 2, 3)]
# The effects that tell its poses, and those of the history.
EFFECTS_OF_BLOCK = (*BUILT, "creep", "dead_time")
# Without a memory every so manieth row tells enough; trial steps of both fits.
EVERY, STATIC_STEPS, STEPS = 6, 20, 5


def peers(report: Report) -> None:
    """All of them."""
    for folder, compare in ((FESTO, festo), (BLOCK, block)):
        if folder.exists():
            compare(report)
        else:
            report(f"logs of {folder.name}", "absent", "", "set FREELEARN_SHARED_DATA to the folder that holds time/")
    stand_ins(report)


def festo(report: Report) -> None:
    """A fluidic muscle, a filling rate left out in turn; each peer fitted to each of 16 configurations by itself."""
    table = festo_logs.read(FESTO)
    left_out = [(table["rate"] == rate).to_numpy() for rate in (8, 9)]
    effects = festo_logs.STATIC

    def one(miss: Callable[[Array], Array], what: str, words: str) -> None:
        began = time.perf_counter()
        missed = [miss(out) for out in left_out]
        share, median = np.mean([festo_logs.shares(table, each) for each in missed], axis=0)
        gone = f", {lost} of 32 recordings run away and are not counted" if (lost := _lost(table, missed)) else ""
        report(f"Festo logs, {what}", f"{share:.2%} ({median:.2%})", "", f"{words}{gone}, {_since(began)}")

    def continuum(left_out: Array) -> Array:
        return festo_logs.physical(table, festo_logs.fitted(table, effects, ~left_out), left_out)

    one(lambda out: festo_logs.linear(table, False, out), "cubic", "4 numbers a configuration")
    one(lambda out: festo_logs.linear(table, True, out), "cubic + plays + creep", "8 numbers a configuration")
    one(lambda out: _narx_of_muscle(table, out), "NARX (SysIdentPy)", "told up to 4 readings a recording")
    one(continuum, f"continuum + {' + '.join(effects)}", "6 numbers in all")


def _narx_of_muscle(table: pd.DataFrame, left_out: Array) -> Array:
    missed = np.full(len(table), np.nan)
    inputs, force = table[["pressure_kpa"]].to_numpy(), table["force_n"].to_numpy()
    for rows in table.groupby(festo_logs.CONFIGURATION).indices.values():
        seen, asked = rows[~left_out[rows]], rows[left_out[rows]]
        narx = Narx([(inputs[seen], force[seen])])
        missed[asked] = _after(narx.told_rows, narx(inputs[asked], force[asked]) - force[asked])
    return missed


def _after(told: int, missed: Array) -> Array:
    """What is missed where nothing was told."""
    return np.where(np.arange(len(missed)) < told, np.nan, missed)


def _lost(table: pd.DataFrame, missed: Sequence[Array]) -> int:
    """Recordings that were left out and end without an answer."""
    ends = [rows[-1] for rows in table.groupby(["sample", "run"]).indices.values()]
    return sum(int(np.isnan(np.array([each[end] for each in missed])).all()) for end in ends)


def block(report: Report) -> None:
    """Three actuators on a free end block: its rise and rotation, every third sweep of the third pressure left out."""
    table, left_out = read_block()
    pose = table[["elongation_mm", "twist_deg"]].to_numpy()
    pressures = table[PRESSURES].to_numpy()
    # All are judged where a NARX model can be asked: in whole stretches, behind the readings that it is told.
    stretches = list(whole(np.isfinite(pose).all(1), STRETCH))
    inside = np.zeros(len(table), dtype=bool)
    for stretch in stretches:
        inside[stretch.start + STRETCH // 2 : stretch.stop] = True
    judged = inside & left_out

    def one(found: Callable[[], Array], what: str, words: str) -> None:
        began = time.perf_counter()
        missed = (found() - pose)[judged]
        counted = np.isfinite(missed).all(1)
        rise, turn = np.sqrt(np.mean(missed[counted] ** 2, axis=0))
        gone = f", {1 - counted.mean():.0%} of the rows run away and are not counted" if not counted.all() else ""
        report(f"free block, {what}", f"{rise:.3f} mm / {turn:.2f}°", "", f"{words}{gone}, {_since(began)}")

    fitted = np.isfinite(pose).all(1) & ~left_out
    for memory, what, words in ((False, "cubic", "40 numbers"), (True, "cubic + plays + creep", "76 numbers")):
        one(lambda memory=memory: _least_squares(table, pressures, pose, fitted, memory), what, words)
    one(lambda: _narx_of_block(pressures, pose, stretches, left_out), "NARX (SysIdentPy)", "told up to 4 poses")
    one(
        lambda: _physical(table, left_out, EFFECTS_OF_BLOCK),
        f"continuum + {' + '.join(EFFECTS_OF_BLOCK)}",
        "14 numbers",
    )


def read_block() -> tuple[pd.DataFrame, Array]:
    """The log as a table of one recording, thinned; and which rows are left out."""
    raw = pd.read_csv(BLOCK)
    jumped = raw["x3_m"] < JUMPED
    command = raw[[f"p{i}_cmd_kpa" for i in (1, 2, 3)]]
    made = pd.DataFrame(
        {
            "sample": 1, "step": np.arange(len(raw)), "elongation_mm": raw["x3_m"].mask(jumped) * 1e3,
            "twist_deg": np.rad2deg(raw["x4_rad"].mask(jumped)), "force_n": 0.0, "moment_nmm": 0.0, "buckled": 0,
            "time_s": raw["time_s"], "run": "1", "number": (command.diff().abs().sum(axis=1) > 0).cumsum(),
            **{name: raw[f"p{i}_kpa"] for i, name in enumerate(PRESSURES, start=1)}, BED: DEAD_LOAD.name,
        }
    )  # fmt: skip
    table = thinned(with_members(made, MEMBERS), RATE)[0]
    return table, (table["number"] // SWEEP % OUT == OUT - 1).to_numpy()


def _least_squares(table: pd.DataFrame, pressures: Array, pose: Array, fitted: Array, memory: bool) -> Array:
    """A full cubic in the three pressures, and plays and creep of each, and of that of its cubic that turns the block:
    by least squares."""
    unit = pressures / np.abs(pressures).max(0)
    powers = [p for p in np.ndindex(4, 4, 4) if sum(p) <= 3]
    columns = [np.prod(unit ** np.array(p), axis=1) for p in powers]
    static = np.stack(columns, axis=1)
    if memory:
        clock = table["time_s"].to_numpy()
        for signal in unit.T:
            columns += festo_logs.plays(signal, festo_logs.PLAYS) + festo_logs.creeps(signal, clock, festo_logs.CREEPS)
        for weight in np.linalg.lstsq(static[fitted], pose[fitted], rcond=None)[0].T:
            columns += festo_logs.creeps(static @ weight / np.abs(static @ weight).max(), clock, festo_logs.CREEPS)
    design = np.stack(columns, axis=1)
    found: Array = design @ np.linalg.lstsq(design[fitted], pose[fitted], rcond=None)[0]
    return found


def _narx_of_block(pressures: Array, pose: Array, stretches: Sequence[slice], left_out: Array) -> Array:
    found = np.full_like(pose, np.nan)
    for channel in (0, 1):
        # A stretch may begin in one sweep and end in the next.
        seen = [(pressures[s], pose[s, channel]) for s in stretches if not left_out[s].any()]
        narx = Narx(seen, degrees=(1, 2), lags=(1, 2, 4))
        for s in stretches:
            found[s, channel] = narx(pressures[s], pose[s, channel])
    return found


def _physical(table: pd.DataFrame, left_out: Array, effects: tuple[str, ...]) -> Array:
    """The continuum model with effects, fitted to what is not left out: without those of the history to every so
    manieth row by itself, then with them along the whole log."""
    shown = table.copy()
    shown.loc[left_out, ["elongation_mm", "twist_deg"]] = np.nan
    apart = shown[np.isfinite(shown["twist_deg"])][::EVERY].drop(columns="run")
    static = tuple(name for name in effects if EFFECTS[name].port != "history")
    model = _fitted(static, START, apart, STATIC_STEPS)
    model = _fitted(effects, model.scalars(), shown, STEPS)
    with torch.no_grad():
        found: Array = model(Rows.from_table(table).states).loads.numpy() * (1e3, 180 / np.pi)
    return found


def _fitted(effects: tuple[str, ...], values: dict[str, float], table: pd.DataFrame, steps: int) -> Model:
    made = [EFFECTS[name](members=len(MEMBERS) if name in BUILT_EACH else 0) for name in EFFECTS if name in effects]
    model: Model = MODELS["continuum"](effects=made)
    model.set_values({name: value for name, value in values.items() if name in model.declared})
    problem, (lower, upper) = Problem(model, Rows.from_table(table)), model.raw_bounds()
    solver = LevenbergMarquardt(
        problem.residuals, problem.jacobians, lower=lower, upper=upper, max_iterations=steps, batched=True
    )
    model.set_vector(solver.solve(model.vector().detach()[None]).member(0).x)
    return model


def _since(began: float) -> str:
    return f"{time.perf_counter() - began:.0f} s"
