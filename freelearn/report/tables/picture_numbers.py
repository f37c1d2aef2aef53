"""Predicted against measured, measured loads, and the states that are reached: the numbers of pictures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from freelearn.data.beds import Pair, Quantity, bed_of
from freelearn.data.columns import SLACK, usable_rows
from freelearn.data.sets import TEST, TRAIN, VALIDATION
from freelearn.data.states import kinematic_state
from freelearn.physics.chain.prediction import usable
from freelearn.queries.curves.curve_rows import measured_quantities, pressures
from freelearn.queries.curves.shown_states import fields, places

SPLITS = (TRAIN, VALIDATION, TEST)
# More points than this per split only darken the picture.
SHOWN = 3000


def parity_numbers(predictions: pd.DataFrame) -> pd.DataFrame:
    """The rows shown: usable ones, at most SHOWN of each split, with their places, what was measured and what is
    predicted; `slack` where the table has it.

    Drawn at random, the same ones each time: every n-th row could fall on the same pressure step of every state.
    predictions: columns of predictions.csv.
    """
    rows = usable(predictions)
    imposed = [q.column for q in (*bed_of(predictions).state, *pressures(predictions))]
    both = [name for q in measured_quantities(predictions) for name in (q.column, q.predicted)]
    marks = [SLACK] if SLACK in predictions else []
    shown = [_thinned(np.flatnonzero(rows["split"] == split)) for split in SPLITS]
    columns = ["sample", *imposed, "split", *both, *marks]
    return rows[columns].iloc[np.concatenate(shown)].reset_index(drop=True)


def split_labels(predictions: pd.DataFrame) -> dict[str, str]:
    """A name for each split that has usable rows, which says how many of them are shown where not all are."""
    count = usable(predictions)["split"].value_counts()
    return {
        split: split if count[split] <= SHOWN else f"{split} ({SHOWN} of {count[split]} shown)"
        for split in SPLITS
        if count.get(split, 0)
    }


def loose_rows(shown: pd.DataFrame) -> np.ndarray:
    """Which rows of parity_numbers are of a tube that hangs loose, (n,) bool."""
    loose: np.ndarray = shown[SLACK].to_numpy() == 1 if SLACK in shown else np.zeros(len(shown), dtype=bool)
    return loose


def parity_ends(shown: pd.DataFrame, quantities: Sequence[Quantity]) -> list[tuple[float, float]]:
    """Ends of the line on which a perfect model would lie, for each quantity. shown: parity_numbers, not empty."""
    both = (shown[[q.column, q.predicted]].to_numpy(dtype=np.float64) for q in quantities)
    return [(float(np.nanmin(values)), float(np.nanmax(values))) for values in both]


def _thinned(part: np.ndarray) -> np.ndarray:
    if len(part) <= SHOWN:
        return part
    thinned: np.ndarray = part[np.sort(np.random.default_rng(0).choice(len(part), SHOWN, replace=False))]
    return thinned


COLUMNS = ["sample", "elongation_mm", "twist_deg", "end", "pressure_kpa", "force_n", "moment_nmm"]


def load_vector_table(table: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place, and its loads at the lowest and the highest usable pressure; of rows with both.

    Columns sample, elongation_mm, twist_deg, end (low, high), pressure_kpa, force_n, moment_nmm."""
    table = table.reset_index(drop=True)
    where = places(table)
    kept = table[usable_rows(table) & table[["force_n", "moment_nmm"]].notna().all(axis=1).to_numpy()]
    pressure = kept["pressure_kpa"].groupby(pd.Series(kinematic_state(table))[kept.index])
    ends = []
    for end, place in (("low", pressure.idxmin()), ("high", pressure.idxmax())):
        loads = table.loc[place, ["pressure_kpa", "force_n", "moment_nmm"]].set_axis(place.index)
        ends.append(where.loc[place.index].join(loads).assign(end=end))
    return pd.concat(ends, ignore_index=True)[COLUMNS]


def admissible_table(table: pd.DataFrame, over: Pair | None = None) -> pd.DataFrame:
    """Each field's place, its number of rows and the share of them that did not buckle.

    Columns sample, those of the place, rows, share. over: see states.fields; by default each kinematic state is one."""
    number, where = fields(table, over)
    kept = (table["buckled"].reset_index(drop=True) == 0).groupby(number).agg(["size", "mean"])
    kept.columns = pd.Index(["rows", "share"])
    return where.join(kept.rename_axis("state")).reset_index(drop=True)


def sample_shares(table: pd.DataFrame) -> dict[int, float]:
    """Share of each sample's rows that did not buckle."""
    share = (table["buckled"] == 0).groupby(table["sample"]).mean()
    return {int(str(sample)): float(value) for sample, value in share.items()}
