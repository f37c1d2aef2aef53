"""How a free end block goes on moving while the pressures stay: no function of the pressures tells that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from rich.table import Table

LOG = Path("time") / "end_block_log" / "log.csv"
COMMANDED, GAUGES = (["p1_cmd_kpa", "p2_cmd_kpa", "p3_cmd_kpa"], ["p1_kpa", "p2_kpa", "p3_kpa"])
# Rise, rotation and one tilt of the block; mm, degrees, degrees.
POSE, SHOWN = ["x3_m", "x4_rad", "x5_rad"], np.array([1e3, 180 / np.pi, 180 / np.pi])
# Parts of each step of 5.1 s whose means are compared [s], the most that a gauge may differ between them [kPa], and
# what a block cannot do: markers jumped. A tilt that changes more than JUMP from one sample to the next, 0.1 s, has
# jumped too [rad].
EARLY, LATE, STEADY, LOWEST, ROUNDEST, JUMP = (1.5, 2.5), (4.0, 5.0), 1.0, -8e-3, 1.57, np.deg2rad(0.5)


def held_pose_table(data: Path) -> Table:
    """Changes within a held step, by the third pressure commanded: root mean squares."""
    log = pd.read_csv(data / LOG)
    log.loc[(log["x3_m"] < LOWEST) | (log["x4_rad"].abs() > ROUNDEST), POSE] = np.nan
    number = (log[COMMANDED].diff().abs().sum(axis=1) > 0).cumsum()
    since = log["time_s"] - log.groupby(number)["time_s"].transform("first")
    early, late = (
        log[since.between(*part)].groupby(number)[[*POSE, *GAUGES, "p3_cmd_kpa"]].mean() for part in (EARLY, LATE)
    )
    change = log["x5_rad"].groupby(number).diff().abs().where(since > EARLY[0])
    moved = (late - early).assign(third=late["p3_cmd_kpa"].round(), jumped=change.groupby(number).max() > JUMP)
    moved = moved[moved[POSE].notna().all(axis=1) & (moved[GAUGES].abs() < STEADY).all(axis=1)]
    shown = Table(
        "third pressure, kPa", "steps", "rise, mm", "rotation, °", "tilt, °", "jumps",
        title=f"end_block_log: what changes from {EARLY} to {LATE} s of a step while no gauge does by {STEADY} kPa",
    )  # fmt: skip
    for third, part in [*moved.groupby("third"), ("all", moved)]:
        rise, turn, tilt = np.sqrt((part[POSE] ** 2).mean()) * SHOWN
        shown.add_row(
            str(third), str(len(part)), f"{rise:.3f}", f"{turn:.2f}", f"{tilt:.2f}", str(part["jumped"].sum())
        )
    return shown
