"""Rows at the end of a file that sum up the others."""

from __future__ import annotations

from collections.abc import Iterator

from freelearn.measurements.intake.cells import is_blank
from freelearn.measurements.intake.raw_table import RawTable

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
        words = sum(raw.style.number(cell) is None for cell in cells)
        numbers = sum(not is_blank(cell) for cell in cells) - words
        if last and words == len(last) and numbers >= LEAST:
            yield name, list(dict.fromkeys(cells[row].strip() for row in last)), [raw.lines[row] for row in last]
