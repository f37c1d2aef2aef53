"""python experiments/festo_logs.py FOLDER: a Festo muscle's logs, fitted as a whole and beside linear peers.

FOLDER holds the logs of Muscle_Sensory (10mm_20cm_Unkink_Test8.csv and so on: force N, pressure kPa, time s, phase;
docs/logs.md says where they come from). Each is one recording, thinned to RATE. The error is the root mean square over
all rows left out, as a share of the largest force of all, and of the largest of each configuration (a length and a
contraction; the median of these). The peers are fitted to each configuration by itself. Nothing sees a reading of a
recording that is left out.

The gauge's zero is what it reads before air comes in. The 65 kPa more that it reads after venting are taken for
pressure that stayed: the muscle's force stays too, at twice its start where it is straight, on the line on which it
came down.
"""

from __future__ import annotations

import logging
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from rich.console import Console

from freelearn.data.beds import BED, ISOMETRIC
from freelearn.data.rows import Rows
from freelearn.data.table.log_tables import thinned
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.queries.inverse.bands import Bands

RATE = 2.0
# Rest length [mm] and largest contraction by the length that a muscle was cut to [cm]; contraction by its label.
REST = {10: 83.0, 20: 182.0, 30: 281.0, 40: 382.0}
LARGEST = {10: 0.1566, 20: 0.1648, 30: 0.1744, 40: 0.1780}
CONTRACTED = {"Unkink": 0.0, "kinked25": 0.25, "kinked50": 0.5, "kinked75": 0.75}
# The gauge settles in the first rows, before which it shows its zero.
SETTLES, BEFORE = 25, 8
OPTIONS = FitOptions("levenberg_marquardt", max_epochs=60, restarts=1, patience=6)
STATIC = ("buckling", "fiber_tension_only", "fiber_misalignment", "length_compliance")
SETS = ((), STATIC[:1], STATIC[1:], STATIC, (*STATIC, "creep"), (*STATIC, "contact_slip"), (*STATIC, "maxwell_slip"))
# What was held, of which the peers are fitted to each by itself.
CONFIGURATION = ["sample", "elongation_mm"]
# Of the linear peer: half widths of plays as shares of the largest pressure, and times of creep [s]; more of either is
# worse on what is left out.
PLAYS, CREEPS = (0.02, 0.1), (0.5, 5.0)


def read(folder: Path) -> pd.DataFrame:
    """All logs as one table, thinned; `rate` tells the test (8 or 9)."""
    parts = []
    for path in sorted(folder.glob("10mm_*cm_*_Test*.csv")):
        found = re.fullmatch(r"10mm_(\d+)cm_(\w+)_Test(\d)", path.stem)
        assert found is not None
        cut = int(found[1])
        whole = pd.read_csv(path, names=["force", "pressure_kpa", "time_s", "phase"])
        zero, raw = float(whole["pressure_kpa"][:BEFORE].median()), whole[SETTLES:]
        parts.append(
            pd.DataFrame(
                {
                    "sample": cut // 10, "length_mm": REST[cut], "step": np.arange(len(raw)),
                    "elongation_mm": -CONTRACTED[found[2]] * LARGEST[cut] * REST[cut],
                    "pressure_kpa": raw["pressure_kpa"].to_numpy() - zero, "force_n": -raw["force"].to_numpy(),
                    "time_s": raw["time_s"].to_numpy(), "run": f"{found[2]}_{found[3]}", "rate": int(found[3]),
                }
            )
        )  # fmt: skip
    design = {"gamma_deg": 25.0, "gamma2_deg": -25.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5, "twist_deg": 0.0}
    table = pd.concat(parts, ignore_index=True).assign(**design, buckled=0, **{BED: ISOMETRIC.name})
    return thinned(table, RATE)[0]


def fitted(table: pd.DataFrame, effects: tuple[str, ...], seen: np.ndarray) -> Model:
    """The continuum model with effects, fitted to some rows, (N,) bool: first without those of the history, of which
    nothing can be told while the model is far off."""
    rows = Rows.from_table(table)[torch.as_tensor(seen)]
    values: dict[str, float] = {}
    for names in dict.fromkeys((tuple(name for name in effects if EFFECTS[name].port != "history"), effects)):
        model = build_model("continuum", values, effects=names)
        fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
        values = model.scalars()
    return model


def physical(table: pd.DataFrame, model: Model, left_out: np.ndarray) -> np.ndarray:
    """Misses of a model on the rows left out, (N,) bool, that was fitted to all others; NaN there."""
    rows = Rows.from_table(table)
    with torch.no_grad():
        missed = rows.readings.missed(model(rows.states).loads)[:, 0].numpy()
    return np.where(left_out, missed, np.nan)


def covered(table: pd.DataFrame, model: Model, left_out: np.ndarray) -> float:
    """Share of the forces left out as in `physical` within their 95 % bands, of an accuracy that nobody has stated."""
    rows = Rows.from_table(table)
    seen, other = (rows[torch.as_tensor(np.flatnonzero(of))] for of in (~left_out, left_out))
    everything = torch.ones(len(seen), dtype=torch.bool)
    bands = Bands.from_model(model, seen, everything, uncertainty(Problem(model, seen)).covariance, None)
    assert bands is not None
    with torch.no_grad():
        shown = model(other.states).loads
    missed = other.readings.missed(shown)[:, 0].abs().numpy()
    return float((missed <= bands.half(other.states, shown)[:, 0]).mean())


def linear(table: pd.DataFrame, memory: bool, left_out: np.ndarray) -> np.ndarray:
    """As `physical`, of a cubic of the pressure, with plays and creep besides, by least squares over each configuration
    by itself."""
    missed = np.full(len(table), np.nan)
    for rows in table.groupby(CONFIGURATION).indices.values():
        part = table.iloc[rows]
        design = np.concatenate([_columns(own, memory) for _, own in part.groupby("run", sort=False)])
        force, out = part["force_n"].to_numpy(), left_out[rows]
        weight = np.linalg.lstsq(design[~out], force[~out], rcond=None)[0]
        missed[rows] = np.where(out, design @ weight - force, np.nan)
    return missed


def shares(table: pd.DataFrame, missed: np.ndarray) -> tuple[float, float]:
    """Root mean square of misses (N,), NaN where nothing was left out: of the largest force of all, and the median of
    each configuration's, of its own largest."""
    force = table["force_n"].abs()
    each = [
        np.sqrt(np.nanmean(missed[rows] ** 2)) / force.iloc[rows].max()
        for rows in table.groupby(CONFIGURATION).indices.values()
        if np.isfinite(missed[rows]).any()
    ]
    return float(np.sqrt(np.nanmean(missed**2)) / force.max()), float(np.median(each))


def _columns(own: pd.DataFrame, memory: bool) -> np.ndarray:
    pressure, time = own["pressure_kpa"].to_numpy() / 600.0, own["time_s"].to_numpy()
    columns = [pressure**k for k in range(4)]
    if memory:
        columns += plays(pressure, PLAYS) + creeps(pressure, time, CREEPS)
    return np.stack(columns, axis=1)


def plays(signal: np.ndarray, widths: tuple[float, ...]) -> list[np.ndarray]:
    """What a signal (n,) drags behind it by plays of these half widths."""
    found = []
    for width in widths:
        play = np.empty_like(signal)
        play[0] = signal[0]
        for n in range(1, len(play)):
            play[n] = min(max(play[n - 1], signal[n] - width), signal[n] + width)
        found.append(play)
    return found


def creeps(signal: np.ndarray, time: np.ndarray, times: tuple[float, ...]) -> list[np.ndarray]:
    """What follows a signal (n,) late by these times."""
    found = []
    for tau in times:
        late = np.empty_like(signal)
        late[0] = signal[0]
        for n in range(1, len(late)):
            late[n] = signal[n] + (late[n - 1] - signal[n]) * np.exp(-(time[n] - time[n - 1]) / tau)
        found.append(late)
    return found


def main(folder: Path) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    console = Console(width=140)
    table = read(folder)
    console.print(f"{table.groupby(['sample', 'run']).ngroups} recordings, {len(table)} rows at {RATE:g} Hz")
    console.print("Left out: a filling rate (of all, median of each); a length (of all, and each length)")
    whole = [(table["rate"] == rate).to_numpy() for rate in (8, 9)]
    for name, memory in (("cubic", False), ("cubic + plays + creep", True)):
        console.print(f"  {name:62}{told(table, [linear(table, memory, out) for out in whole])}")
    left_out = [*whole, *((table["sample"] == sample).to_numpy() for sample in (1, 2, 3, 4))]
    models = {}
    for effects in SETS:
        models[effects] = [fitted(table, effects, ~out) for out in left_out]
        missed = [physical(table, model, out) for model, out in zip(models[effects], left_out, strict=True)]
        rates = told(table, missed[:2])
        each = [shares(table, own)[0] for own in missed[2:]]
        lengths = f"{np.mean(each):8.2%} ({', '.join(f'{error:.2%}' for error in each)})"
        console.print(f"  {' + '.join(effects) or 'the model alone':62}{rates}{lengths}")
    held = [covered(table, model, out) for model, out in zip(models[STATIC], left_out, strict=True)]
    for what, each in (("a filling rate", held[:2]), ("a length", held[2:])):
        console.print(
            f"Within 95 % bands of {' + '.join(STATIC)}, {what} left out: {', '.join(f'{e:.1%}' for e in each)}"
        )
    everything = fitted(table, (*STATIC, "creep"), np.ones(len(table), dtype=bool)).scalars()
    console.print(f"Fitted to all (SI): {', '.join(f'{name} {value:.4g}' for name, value in everything.items())}")


def told(table: pd.DataFrame, misses: list[np.ndarray]) -> str:
    """The mean of both shares over what was left out in turn."""
    return "".join(f"{share:8.2%}" for share in np.mean([shares(table, missed) for missed in misses], axis=0))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
