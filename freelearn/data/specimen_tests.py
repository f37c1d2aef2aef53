"""The tests in a table of specimens: each way of loading, and each recording of one, thinned to what it shows."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.specimen_schema import MODES

TIME = "time_s"
# With fewer samples the overstress of a recording cannot be told from its modulus.
LEAST = 8
# Samples that are kept of a recording: a fit of more takes longer and finds the same.
MOST = 200
# A specimen moves where its stretch changes at more than this share of its fastest rate.
MOVES = 0.02
# A recording begins at rest where it is stretched by no more than this share of its largest strain.
AT_REST = 0.05


def timed(table: pd.DataFrame) -> np.ndarray:
    """Whether each row belongs to a recording, (N,) bool."""
    return table[TIME].notna().to_numpy() if TIME in table else np.zeros(len(table), dtype=bool)


def names_of(table: pd.DataFrame) -> np.ndarray:
    """The test that each row belongs to, (N,) str: its mode or, of a recording, its specimen; mode and specimen where
    several modes have one specimen."""
    specimen = table["specimen"].astype(str)
    several = table["mode"].groupby(specimen).transform("nunique") > 1
    recording = specimen.where(~(several | specimen.isin(MODES)), table["mode"].str.cat(specimen, sep=" "))
    names: np.ndarray = np.where(timed(table), recording, table["mode"])
    return names


def tests_of(table: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """The rows of each test by its name, in the order of the table."""
    names = names_of(table)
    return {str(name): table[names == name] for name in dict.fromkeys(names)}


def check_recordings(table: pd.DataFrame) -> None:
    """Raises UserError for a recording that is too short, does not begin at rest, or stands in two files."""
    for name, rows in tests_of(table[timed(table)]).items():
        if len(rows) < LEAST:
            samples = "1 sample" if len(rows) == 1 else f"{len(rows)} samples"
            raise UserError(
                f"Recording {name} has {samples}, and a fit over time needs {LEAST}: record faster, or leave {TIME} "
                "out."
            )
        if (rows[TIME].diff() <= 0).any():
            raise UserError(
                f"Recording {name} stands in two files: name the specimens in a column specimen, or rename a file."
            )
        strain = (rows["stretch"] - 1).abs()
        if strain.iloc[0] > AT_REST * strain.max():
            raise UserError(
                f"Recording {name} begins at a stretch of {rows['stretch'].iloc[0]:.4g}, and how it came there decides "
                "what it shows: keep the rows from rest on, or add a row at a stretch of 1 when the pull began."
            )
        if rows[["stress_mpa", "stress_2_mpa"]].isna().all(axis=None):
            raise UserError(f"Recording {name} holds no stress: fill in its stresses, or leave its rows out.")


def thinned(table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """The table with at most MOST samples of each recording, close to each other where it moves or has just stopped,
    and a sentence on how many there were."""
    keep = np.ones(len(table), dtype=bool)
    names = names_of(table)
    longest = 0
    for name in dict.fromkeys(names[timed(table)]):
        place = np.flatnonzero(names == name)
        if len(place) > MOST:
            rows = table.iloc[place]
            keep[place] = False
            keep[place[_spread(rows[TIME].to_numpy(), rows["stretch"].to_numpy())]] = True
            longest = max(longest, len(place))
    if not longest:
        return table, []
    return table[keep].reset_index(drop=True), [
        f"Recordings of up to {longest} samples are thinned to about {MOST} each: more where the specimen moves or has "
        "just stopped."
    ]


def _spread(time: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Places of about MOST samples: even along the way of the stretch, and along the logarithm of the time since it
    last moved."""
    step, moved = np.diff(time), np.abs(np.diff(stretch))
    rate = moved / step
    moves = rate > MOVES * np.quantile(rate, 0.99) if moved.any() else np.zeros(len(step), dtype=bool)
    start = np.maximum.accumulate(np.where(moves, time[1:], time[0]))
    unit = float(np.median(step[moves])) if moves.any() else float(step.min())
    age = np.log1p(np.maximum(time[1:] - start, 0.0) / unit)
    held = np.where(moves, 0.0, np.maximum(np.diff(age, prepend=0.0), 0.0))
    ways = [way / way.sum() for way in (np.where(moves, moved, 0.0), held) if way.sum() > 0] or [step / step.sum()]
    path = np.concatenate([[0.0], np.cumsum(sum(ways))])
    chosen = np.searchsorted(path, np.linspace(0.0, path[-1], MOST)).clip(0, len(time) - 1)
    # The ends of every hold, so that no ramp begins early.
    turns = np.flatnonzero(np.diff(moves.astype(int)) != 0) + 1
    turns = turns if len(turns) < MOST // 4 else turns[:0]
    return np.unique(np.concatenate([chosen, turns, [0, len(time) - 1]]))
