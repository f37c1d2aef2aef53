"""Which recording each row of a log is of: by a column of the file, or by where its time begins anew."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.intake.evaluate import FILE, LINE, NAMED
from freelearn.data.intake.readers.cells import few
from freelearn.data.intake.recipes.recipe import Recordings
from freelearn.data.logs import TIME
from freelearn.data.table.log_tables import jump


def recordings_of(rows: pd.DataFrame, recordings: Recordings) -> tuple[np.ndarray, list[str]]:
    """The recording of each row (N,), numbers from 1 up or the words of the column that says them; and what was found,
    in sentences. rows: of all files in their order. Raises UserError where a time, or a recording's name, is blank."""
    if TIME not in rows:
        raise UserError(f"run needs the time of the rows: add {TIME} to columns of the recipe, or leave run out.")
    _refuse_blank(rows, TIME, rows[TIME].isna().to_numpy(), "its time, or drop the row")
    files = rows[FILE].to_numpy()
    if recordings.source is not None:
        words = rows[NAMED].astype(str).str.strip()
        _refuse_blank(rows, "run", (words == "").to_numpy(), "the recording's name, or drop the row")
        several = len(set(files)) > 1
        return np.asarray(rows[FILE].astype(str) + " " + words if several else words), []
    time, lines = rows[TIME].to_numpy(np.float64), rows[LINE].to_numpy()
    other = (files[1:] != files[:-1]) | (rows["sample"].to_numpy()[1:] != rows["sample"].to_numpy()[:-1])
    starts = [0, *(np.flatnonzero(other) + 1), len(rows)]
    begins = [b for first, end in pairwise(starts) for b in _begins(time[first:end], first)]
    sentences = []
    for name in dict.fromkeys(files):
        anew = [int(lines[b]) for b in begins if files[b] == name and b not in starts]
        if anew:
            where = f"line{'s' if anew[1:] else ''} {few(anew)}"
            sentences.append(
                f"{name}: the time begins anew, or jumps, at {where}: {len(anew) + 1} recordings were made of it."
            )
    run = np.zeros(len(rows), dtype=np.int64)
    run[begins] = 1
    return np.cumsum(run), sentences


def _begins(time: np.ndarray, first: int) -> Iterator[int]:
    """The first row of each recording among rows of one file and one actuator, of which `first` is the first: the time
    falls before it, or jumps as no clock does within a recording."""
    falls = [0, *(np.flatnonzero(np.diff(time) < 0) + 1), len(time)]
    for start, end in pairwise(falls):
        yield from _without_jumps(time[start:end], first + start)


def _without_jumps(time: np.ndarray, first: int) -> Iterator[int]:
    step = np.diff(time)
    at = jump(step) if len(step) else None
    if at is None:
        yield first
        return
    yield from _without_jumps(time[: at + 1], first)
    yield from _without_jumps(time[at + 1 :], first + at + 1)


def _refuse_blank(rows: pd.DataFrame, name: str, blank: np.ndarray, cure: str) -> None:
    if blank.any():
        file, line = rows.loc[np.flatnonzero(blank)[0], [FILE, LINE]]
        raise UserError(f"{file}, line {line}: {name} is blank, and a log's rows have one each: give {cure}.")
