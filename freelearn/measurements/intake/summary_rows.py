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


def summary_rows(raw: RawTable) -> Iterator[str]:
    """A sentence for each column of numbers in whose last rows such a word stands.

    >>> raw = RawTable("a.csv", {"t": ["1", "2", "3", "Mean"], "F": ["1", "2", "3", "2"]}, [2, 3, 4, 5])
    >>> next(summary_rows(raw))
    "sums and means are no readings: 'Mean' on line 5: leave them out with drop: {t: Mean}."
    """
    for name, cells in raw.columns.items():
        last = [row for row in range(max(len(raw) - LAST, 0), len(raw)) if cells[row].strip(" :.").lower() in WORDS]
        words = sum(raw.style.number(cell) is None for cell in cells)
        numbers = sum(not is_blank(cell) for cell in cells) - words
        if last and words == len(last) and numbers >= LEAST:
            words_there = list(dict.fromkeys(cells[row].strip() for row in last))
            shown = words_there[0] if len(words_there) == 1 else f"[{', '.join(words_there)}]"
            lines = ", ".join(str(raw.lines[row]) for row in last)
            yield (
                f"sums and means are no readings: {', '.join(map(repr, words_there))} on line {lines}: leave them out "
                f"with drop: {{{name}: {shown}}}."
            )
