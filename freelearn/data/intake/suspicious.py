"""Numbers of a laboratory's file that look wrong: said, never changed."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np
import pandas as pd

from freelearn.data.beds import BEDS
from freelearn.data.columns import members_in, pressure_columns
from freelearn.data.intake.readers.cells import is_blank
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import NEEDED_DESIGN
from freelearn.data.intake.scale_jumps import scale_jumps
from freelearn.data.piled import piled
from freelearn.data.table.unit_suspicions import unit_warnings

# Whether the force under pressure has the sign that the fiber angle gives it.

# tan² of the angle at which neither push nor pull remains is 2 (54.7°): judged well to both sides of it only.
PULLS, PUSHES = 1.2, 3.3
NEEDED = ("sample", "gamma_deg", "length_mm", "elongation_mm", "pressure_kpa", "force_n")
# Rows of one state from which a slope is told, the share of the table's pressures that they go through, and that of the
# states which must agree.
LEAST_ROWS, LEAST_SPAN, AGREE = 3, 0.1, 0.8


def pull_signs(table: pd.DataFrame) -> Iterator[str]:
    """A sentence for actuators whose force goes the wrong way with the pressure.

    Inextensible fibers at the angle γ to the axis leave the push π r² P (1 − 2 / tan² γ): below 54.7° a pull. A
    stretch λ turns cos γ into λ cos γ.
    """
    if not set(NEEDED) <= set(table):
        return
    wrong = right = 0
    expected_pull = True
    state = ["sample", "elongation_mm", *(["twist_deg"] if "twist_deg" in table else [])]
    there = table.dropna(subset=["pressure_kpa", "force_n"])
    # Of a log nearly every row may be a state of its own.
    there = there[there.groupby(state)["force_n"].transform("size") >= LEAST_ROWS]
    span = float(np.ptp(there["pressure_kpa"])) if len(there) else 0.0
    for _, rows in there.groupby(state):
        one = rows.iloc[0]
        if np.ptp(rows["pressure_kpa"]) <= LEAST_SPAN * span:
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


# So many rows from the end are looked at, and so many others must be numbers.
LAST, LEAST = 8, 3
WORDS = {
    *("mean", "average", "avg", "median", "sum", "total", "min", "minimum", "max", "maximum", "std", "sd", "stdev"),
    *("count", "n", "rms", "mittelwert", "summe", "gesamt", "moyenne", "media", "suma", "range"),
}


def without_sums(raw: RawTable) -> RawTable:
    """The rows that are readings."""
    lines = {line for _, _, of in summary_rows(raw) for line in of}
    return raw.rows([row for row, line in enumerate(raw.lines) if line not in lines]) if lines else raw


def summary_rows(raw: RawTable) -> Iterator[tuple[str, list[str], list[int]]]:
    """Each column of numbers in whose last rows such words stand, with the words and their lines.

    >>> raw = RawTable("a.csv", {"t": ["1", "2", "3", "Mean"], "F": ["1", "2", "3", "2"]}, [2, 3, 4, 5])
    >>> next(summary_rows(raw))
    ('t', ['Mean'], [5])
    """
    for name, cells in raw.columns.items():
        last = [row for row in range(max(len(raw) - LAST, 0), len(raw)) if cells[row].strip(" :.").lower() in WORDS]
        if not last:
            continue
        words = sum(raw.style.number(cell) is None for cell in cells)
        numbers = sum(not is_blank(cell) for cell in cells) - words
        if words == len(last) and numbers >= LEAST:
            yield name, list(dict.fromkeys(cells[row].strip() for row in last)), [raw.lines[row] for row in last]


# Columns from which units are judged.
UNITS_JUDGED_BY = (*NEEDED_DESIGN, "step", "elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm")
# A vented gauge reads no more than this [kPa]; beds keep a few kPa to hold a tube open.
REST_KPA = 20.0
# A visit to a state ends vented below this share of the largest pressure; where so many do, they go back there.
VENTED_SHARE = 0.3
# Rows whose states change so many times as often as there are states do not stand by states.
SCATTERED = 1.5
# States, and levels of each, that are alike only where the pressures were set.
SET_STATES, SET_LEVELS = 3, 6


def raw_suspicions(raw: RawTable, readings: Sequence[str], time: str | None, sums: bool = True) -> list[str]:
    """Sentences about a file's columns. readings: those of the bed's instruments; time: the column of time, if any.
    sums: whether rows that sum up others are among them."""
    read = [name for name in dict.fromkeys(readings) if name in raw.columns]
    whole = (_twice(raw), _rows_twice(raw), *((_summed_up(raw),) if sums else ()))
    checks = (*whole, _constant(raw, read), _saturated(raw, read), _backwards(raw, time))
    return [f"{raw.name}: {sentence}" for check in checks for sentence in check]


def _twice(raw: RawTable) -> Iterator[str]:
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, cells in raw.columns.items():
        alike.setdefault(tuple(cells), []).append(name)
    for same, names in alike.items():
        if len(names) > 1 and len({cell for cell in same if not is_blank(cell)}) > 1:
            shown = " and ".join(map(repr, names))
            yield f"columns {shown} are the same, cell by cell: a channel may have been saved twice."
    first = {names[0] for names in alike.values()}
    for name in raw.columns:
        if name in first and name.endswith("]") and (plain := name.rsplit(" [", 1)[0]) in raw.columns:
            yield f"two columns are called {plain!r} and differ; the second is {name!r} here."


def _summed_up(raw: RawTable) -> Iterator[str]:
    for name, words, lines in summary_rows(raw):
        shown = words[0] if len(words) == 1 else f"[{', '.join(words)}]"
        yield (
            f"sums and means are no readings: {', '.join(map(repr, words))} on line {', '.join(map(str, lines))}: "
            f"leave them out with drop: {{{name}: {shown}}}."
        )


def _rows_twice(raw: RawTable) -> Iterator[str]:
    rows = pd.Series(list(zip(*raw.columns.values(), strict=True)))
    filled = np.array([not all(is_blank(cell) for cell in row) for row in rows])
    again = rows.duplicated().to_numpy() & filled
    if again.any():
        lines = [raw.lines[i] for i in np.flatnonzero(again)]
        yield f"{len(lines)} rows stand there twice (line {lines[0]}{' and others' if len(lines) > 1 else ''})."


def _constant(raw: RawTable, readings: Sequence[str]) -> Iterator[str]:
    for name in readings:
        values = raw.most_numbers(name)
        if values is not None and len(values) > 2 and len(np.unique(values[~np.isnan(values)])) == 1:
            value = values[~np.isnan(values)][0]
            yield f"column {name!r} is {value:g} in every row: look whether the channel was connected."


def _saturated(raw: RawTable, readings: Sequence[str]) -> Iterator[str]:
    for name in readings:
        values = raw.most_numbers(name)
        if values is None:
            continue
        for end, count in piled(values):
            what = "largest" if end == np.nanmax(values) else "smallest"
            yield f"column {name!r} is {end:g}, its {what} value, in {count} rows: saturated?"


def _backwards(raw: RawTable, time: str | None) -> Iterator[str]:
    values = raw.most_numbers(time) if time else None
    back = np.flatnonzero(np.diff(values if values is not None else np.zeros(0)) < 0)
    if len(back):
        yield (
            f"time {time!r} runs backwards at line {raw.lines[int(back[0]) + 1]} ({len(back)} times in all): order the "
            "rows with order_by; where several recordings follow each other, say run: derive, or leave time_s out."
        )


def still_open(sentences: Sequence[str], as_read: Collection[str]) -> list[str]:
    """The sentences but for those that doubt a pressure's zero of which somebody has said that it is right: those of
    the columns `as_read`."""
    doubts = ("may be absolute", "is never below", "goes back to")
    settled = tuple(f"{name} {doubt}" for name in as_read for doubt in doubts)
    return [sentence for sentence in sentences if not sentence.startswith(settled)]


def table_suspicions(table: pd.DataFrame, bed: str) -> list[str]:
    """Sentences about a table that was made: scales that jump, gauges that read too much at rest, units and
    signs that look wrong."""
    measured = [q.column for q in BEDS[bed].measured if q.column in table]
    checks = (scale_jumps(table, measured), _gauge(table), _scattered(table, bed), pull_signs(table))
    sentences = [sentence for check in checks for sentence in check]
    return sentences + (unit_warnings(table) if set(UNITS_JUDGED_BY) <= set(table) else [])


def _scattered(table: pd.DataFrame, bed: str) -> Iterator[str]:
    """States whose rows do not stand together, because the rows are sorted by the pressure."""
    state = [q.column for q in BEDS[bed].state if q.column in table]
    if "pressure_kpa" not in table or "time_s" in table or len(state) < 2:
        return
    keys = table[["sample", *state]]
    runs, states = int((keys != keys.shift()).any(axis=1).sum()), len(keys.drop_duplicates())
    falls = table.groupby("sample", sort=False)["pressure_kpa"].diff().lt(0).any()
    if runs > SCATTERED * states and not falls and (keys["sample"].diff() != 0).sum() == keys["sample"].nunique():
        yield (
            f"the rows are sorted by the pressure, so that {states} states fall into {runs}: put each state's rows "
            f"together with order_by: [the columns of {' and '.join(state)}], or read the log as it was measured."
        )


def _gauge(table: pd.DataFrame) -> Iterator[str]:
    names = pressure_columns(members_in(list(table.columns)))
    visit = (table["step"].diff().fillna(0) <= 0).cumsum().to_numpy()
    for name in names:
        lowest, vented = gauge_at_rest(table[name].to_numpy(dtype=np.float64), visit, len(names) == 1)
        if lowest is not None:
            yield f"{name} is never below {lowest:.3g}: if the gauge reads that at rest, give it as offset."
        elif vented is not None:
            yield f"{name} goes back to {vented:.3g} and no lower: if the gauge reads that at rest, give it as offset."


def gauge_at_rest(pressures: np.ndarray, visit: np.ndarray, alone: bool) -> tuple[float | None, float | None]:
    """What a gauge may read at rest [kPa]: the lowest reading, and the one that it goes back to as visits to a state
    end; None where no gauge at rest would read it. visit: number of each row's visit. alone: whether it is the only
    one; of several actuators none is vented at the end of a visit."""
    if np.isnan(pressures).all() or _commanded(pressures, visit):
        return None, None
    lowest = float(np.nanmin(pressures))
    ends = pd.Series(pressures).groupby(visit).last()
    vented = ends[ends < VENTED_SHARE * np.nanmax(pressures)]
    often = alone and len(vented) >= 2 and len(vented) >= VENTED_SHARE * len(ends)
    back = float(vented.median()) if often else None
    return lowest if lowest > REST_KPA else None, back if back is not None and back > REST_KPA else None


def _commanded(values: np.ndarray, visit: np.ndarray) -> bool:
    """Whether these are pressures that were set and not read: the same few levels, to the last digit, at every state.

    Of a gauge that reads too much at rest no two visits agree so.
    """
    levels = pd.DataFrame({"visit": visit, "level": values}).drop_duplicates()
    every = levels["level"].nunique(dropna=False)
    each = levels.groupby("visit").size()
    return len(each) >= SET_STATES and every >= SET_LEVELS and bool((each == every).all())
