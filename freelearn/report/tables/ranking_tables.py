"""How much each effect would explain, how alike they are, and how the error falls from step to step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.formats import RUN_AWAY, chance, error_percent, fixed, known_floor
from freelearn.discovery.thresholds import CLEAR

# Effects more alike than this can hardly be told apart.
COLLINEAR = 0.95


def cosine_table(names: list[str], cosine: np.ndarray) -> pd.DataFrame:
    """Largest cosine between the traces of each two effects after refitting, 1 for twins: column `effect`, and one for
    each effect that left a trace. cosine: (k, k), of the k effects named."""
    table = pd.DataFrame(cosine, columns=names)
    table.insert(0, "effect", names)
    return table


# How much each effect would explain, as numbers and as a table.

# What p tells of an effect, however large: how much the rest of the misfit would give to any by chance.
STANDS_OUT, NO_MORE = f"stands out, p ≤ {CLEAR:g}", "may be the rest of the misfit"

# Of a candidate in discovery.json.
COLUMNS = ["effect", "p_value", "E_heldout", "E_new_sample", "score", "step", "status", "reason"]


def ranking_numbers(candidates: Sequence[Mapping[str, Any]], step: int = 0) -> pd.DataFrame:
    """The tested candidates of one step of discovery.json, largest first: effect, size [σ], p_value, E_heldout, and
    what else stands there.

    >>> ranking_numbers([{"effect": "end_clamps", "status": "tested", "step": 0, "score": 4.0, "p_value": 0.01,
    ...                   "E_heldout": None}])["size"].tolist()
    [2.0]
    """
    rows = [c for c in candidates if c["status"] == "tested" and c["step"] == step]
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"score": float, "p_value": float, "E_heldout": float})
    table.insert(1, "size", np.sqrt(table["score"].clip(lower=0)))
    return table.sort_values("size", ascending=False).reset_index(drop=True)


def ranking_table(numbers: pd.DataFrame, most: int | None = None) -> DisplayTable:
    """numbers: of ranking_numbers. most: effects shown, None for all."""
    columns = [numbers[name].tolist() for name in ("effect", "size", "p_value", "E_heldout")]
    rows = [
        [effect, fixed(size, 1), chance(p_value, 3), error_percent(error, 3)]
        for effect, size, p_value, error in list(zip(*columns, strict=True))[:most]
    ]
    return DisplayTable.from_rows(
        ["effect"],
        ["effect size", "p by chance", "E held-out %"],
        rows,
        title="Which effects would explain it, before any was added",
    )


def untested_lines(candidates: Sequence[Mapping[str, Any]]) -> list[str]:
    """Effects that were not tested at first, and why."""
    return [
        f"{c['effect']}: {c['reason']}" for c in candidates if c["status"] != "tested" and c.get("step") in (0, None)
    ]


# The error falling from step to step towards the noise floor: numbers, table and the axis of both pictures.

# Share of the axis that is left free below the lowest and above the highest.
ROOM = 0.15
# An axis up to so many times as high as low has numbers closer to each other.
DECADE = 12.0
# The axis where nothing is known [%].
EMPTY = (1.0, 10.0)


class Staircase(NamedTuple):
    """E, floor: (steps,) in %, NaN where they are not known. labels: E in words, "" where it is not known; under:
    (steps,), whether E is below the floor, and its label with it. low, high: ends of a logarithmic axis. On a linear
    one the last steps, which decide, would not show."""

    steps: list[str]
    E: np.ndarray
    floor: np.ndarray
    labels: list[str]
    under: np.ndarray
    low: float
    high: float

    @property
    def ticks(self) -> list[float]:
        """Numbers for the axis: 1, 2 and 5, and more where it spans less than a decade or so."""
        steps = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if self.high < DECADE * self.low else (1.0, 2.0, 5.0)
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        return [tick for power in powers for step in steps if self.low <= (tick := step * 10.0**power) <= self.high]


def staircase(trail: pd.DataFrame) -> Staircase:
    """What both pictures draw. trail: step, E_heldout, noise_floor (fractions), see discovery.trail_numbers."""
    error, floor = (100 * trail[name].to_numpy(dtype=np.float64) for name in ("E_heldout", "noise_floor"))
    floor = np.where(floor < 100, floor, np.nan)
    away = error > 100 * RUN_AWAY
    error = np.where(away & np.isfinite(error), 100 * RUN_AWAY, error)
    # A model without an answer at a held-out state has no error that an axis could show, and zero has no logarithm.
    both = np.r_[error, floor]
    known = both[np.isfinite(both) & (both > 0)]
    low, high = (float(known.min()), float(known.max())) if len(known) else EMPTY
    error, floor = (np.where(np.isfinite(values) & (values > 0), values, np.nan) for values in (error, floor))
    labels = [
        "" if np.isnan(value) else f"> {value:.0f} %" if beyond else f"{value:.3g} %"
        for value, beyond in zip(error, away, strict=True)
    ]
    # So many times as much at either end that a label has its room, however far the error falls.
    room = max(1.6, (high / low) ** ROOM)
    return Staircase(list(trail["step"]), error, floor, labels, error < floor, low / room, high * room)


def staircase_row(step: str, fitted: float, heldout: float, floor: float, sigmas: float) -> list[str]:
    """The cells of one step; errors as fractions."""
    return [step, *(error_percent(value, 3) for value in (fitted, heldout, known_floor(floor))), fixed(sigmas, 2)]


HEADINGS = ("E fitted %", "E held-out %", "noise floor %", "misfit in noise standard deviations")


def staircase_table(trail: pd.DataFrame) -> DisplayTable:
    """trail: see discovery.trail_numbers."""
    columns = [trail[name].tolist() for name in ("step", "E_train", "E_heldout", "noise_floor", "sigmas_heldout")]
    rows = [staircase_row(*cells) for cells in zip(*columns, strict=True)]
    return DisplayTable.from_rows(["step"], HEADINGS, rows, title="The error, step by step")
