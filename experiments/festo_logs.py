"""python experiments/festo_logs.py FOLDER: a Festo muscle's logs, fitted as a whole and beside linear peers.

FOLDER holds the logs of Muscle_Sensory (10mm_20cm_Unkink_Test8.csv and so on: force N, pressure kPa, time s, phase;
docs/logs.md says where they come from). Each is one recording, thinned to RATE. The error is the root mean square over
the left-out rows, as a share of the largest force of all; of the peers, which are fitted to each length and contraction
by itself, the median over these too. Nothing sees a reading of a recording that is left out.
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

from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.measurements.beds import BED, ISOMETRIC
from freelearn.measurements.rows import Rows
from freelearn.measurements.thinned import thinned
from freelearn.models.build import build_model

RATE = 2.0
# Rest length [mm] and largest contraction by the length that a muscle was cut to [cm]; contraction by its label.
REST = {10: 83.0, 20: 182.0, 30: 281.0, 40: 382.0}
LARGEST = {10: 0.1566, 20: 0.1648, 30: 0.1744, 40: 0.1780}
CONTRACTED = {"Unkink": 0.0, "kinked25": 0.25, "kinked50": 0.5, "kinked75": 0.75}
# The gauge settles in the first rows, and reads this much when all air is out [kPa].
SETTLES, ZERO_KPA = 25, 73.0
# Held shorter than its rest a muscle hangs loose below this pull [N].
LOOSE = 6.0
OPTIONS = FitOptions("levenberg_marquardt", max_epochs=60, restarts=1, patience=6)
STATIC = ("length_compliance", "force_offset")
SETS = ((), STATIC, (*STATIC, "contact_slip"), (*STATIC, "maxwell_slip"), (*STATIC, "maxwell_slip", "creep"))
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
        raw = pd.read_csv(path, names=["force", "pressure_kpa", "time_s", "phase"])[SETTLES:]
        parts.append(
            pd.DataFrame(
                {
                    "sample": cut // 10, "length_mm": REST[cut], "step": np.arange(len(raw)),
                    "elongation_mm": -CONTRACTED[found[2]] * LARGEST[cut] * REST[cut],
                    "pressure_kpa": raw["pressure_kpa"].to_numpy() - ZERO_KPA, "force_n": -raw["force"].to_numpy(),
                    "time_s": raw["time_s"].to_numpy(), "run": f"{found[2]}_{found[3]}", "rate": int(found[3]),
                }
            )
        )  # fmt: skip
    design = {"gamma_deg": 25.0, "gamma2_deg": -25.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5, "twist_deg": 0.0}
    table = pd.concat(parts, ignore_index=True).assign(**design, buckled=0, **{BED: ISOMETRIC.name})
    table = thinned(table, RATE)[0]
    return table.assign(slack=((table["force_n"] > -LOOSE) & (table["elongation_mm"] < 0)).astype(int))


def physical(table: pd.DataFrame, effects: tuple[str, ...], left_out: np.ndarray) -> float:
    """Error of the continuum model with effects on the rows left out, (N,) bool, fitted to all others."""
    rows = Rows.from_table(table)
    model = build_model("continuum", effects=effects)
    seen = rows[torch.as_tensor(np.flatnonzero(~left_out))]
    fit(model, seen, seen[torch.arange(0)], OPTIONS, seed=0)
    with torch.no_grad():
        missed = rows.readings.missed(model(rows.states).loads)[:, 0].numpy()
    return float(np.sqrt(np.mean(missed[left_out] ** 2)) / table["force_n"].abs().max())


def linear(part: pd.DataFrame, left_out: np.ndarray, memory: bool) -> float:
    """Error of a cubic of the pressure, with plays and creep besides, by least squares over one configuration."""
    columns = pd.concat([_columns(own, memory) for _, own in part.groupby("run", sort=False)])
    design, force = columns.to_numpy(), part["force_n"].to_numpy()
    weight = np.linalg.lstsq(design[~left_out], force[~left_out], rcond=None)[0]
    missed = (design @ weight - force)[left_out]
    return float(np.sqrt(np.mean(missed**2)) / part["force_n"].abs().max())


def _columns(own: pd.DataFrame, memory: bool) -> pd.DataFrame:
    pressure, time = own["pressure_kpa"].to_numpy() / 600.0, own["time_s"].to_numpy()
    columns = [pressure**k for k in range(4)]
    if memory:
        for width in PLAYS:
            play = np.empty_like(pressure)
            play[0] = pressure[0]
            for n in range(1, len(play)):
                play[n] = min(max(play[n - 1], pressure[n] - width), pressure[n] + width)
            columns.append(play)
        for tau in CREEPS:
            late = np.empty_like(pressure)
            late[0] = pressure[0]
            for n in range(1, len(late)):
                late[n] = pressure[n] + (late[n - 1] - pressure[n]) * np.exp(-(time[n] - time[n - 1]) / tau)
            columns.append(late)
    return pd.DataFrame(np.stack(columns, axis=1), index=own.index)


def main(folder: Path) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    console = Console(width=120)
    table = read(folder)
    console.print(f"{table.groupby(['sample', 'run']).ngroups} recordings, {len(table)} rows at {RATE:g} Hz")
    console.print("A filling rate left out, each configuration by itself, of its largest force: median and worst")
    for name, memory in (("cubic", False), ("cubic + plays + creep", True)):
        errors = [
            linear(part, (part["rate"] == rate).to_numpy(), memory)
            for _, part in table.groupby(["sample", "elongation_mm"], sort=False)
            for rate in (8, 9)
        ]
        console.print(f"  {name:24}{np.median(errors):8.2%}{max(errors):8.2%}")
    console.print("One set of parameters for all, of the largest force of all: a rate left out, a length left out")
    for effects in SETS:
        rates = [physical(table, effects, (table["rate"] == rate).to_numpy()) for rate in (8, 9)]
        lengths = [physical(table, effects, (table["sample"] == sample).to_numpy()) for sample in (1, 2, 3, 4)]
        each = ", ".join(f"{error:.2%}" for error in lengths)
        console.print(
            f"  {' + '.join(effects) or 'the model alone':56}{np.mean(rates):8.2%}{np.mean(lengths):8.2%} ({each})"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
