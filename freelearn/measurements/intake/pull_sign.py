"""Whether the force under pressure has the sign that the fiber angle gives it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

# tan² of the angle at which neither push nor pull remains is 2 (54.7°): judged well to both sides of it only.
PULLS, PUSHES = 1.2, 3.3
NEEDED = ("sample", "gamma_deg", "length_mm", "elongation_mm", "pressure_kpa", "force_n")
# Rows of one state from which a slope is told, and the states that must agree.
LEAST_ROWS, AGREE = 3, 0.8


def pull_signs(table: pd.DataFrame) -> Iterator[str]:
    """A sentence for actuators whose force goes the wrong way with the pressure.

    Inextensible fibers at the angle γ to the axis leave the push π r² P (1 − 2 / tan² γ): below 54.7° a pull. A
    stretch λ turns cos γ into λ cos γ.
    """
    if not set(NEEDED) <= set(table):
        return
    wrong = right = 0
    expected_pull = True
    for _, rows in table.groupby(["sample", "elongation_mm", *(["twist_deg"] if "twist_deg" in table else [])]):
        rows = rows.dropna(subset=["pressure_kpa", "force_n"])
        one = rows.iloc[0] if len(rows) else None
        if one is None or len(rows) < LEAST_ROWS or np.ptp(rows["pressure_kpa"]) == 0:
            continue
        cosine = abs(np.cos(np.deg2rad(one["gamma_deg"]))) * (1 + one["elongation_mm"] / one["length_mm"])
        square = 1 / cosine**2 - 1 if 0 < cosine < 1 else 0.0
        if PULLS < square < PUSHES:
            continue
        pressure = rows["pressure_kpa"].to_numpy(np.float64)
        slope = float(np.polyfit(pressure / np.ptp(pressure), rows["force_n"].to_numpy(np.float64), 1)[0])
        if slope and (slope > 0) == (square <= PULLS):
            wrong, expected_pull = wrong + 1, square <= PULLS
        else:
            right += 1
    if wrong and wrong >= AGREE * (wrong + right):
        told = ("rises", "pull, which is negative here") if expected_pull else ("falls", "push, which is positive here")
        yield (
            f"force_n {told[0]} with the pressure in {wrong} of {wrong + right} states, but fibers at this angle "
            f"{told[1]}: look at sign: -1 of the force, and at the fiber angle (0° lies along the axis)."
        )
