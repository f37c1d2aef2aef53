"""What stands over and under the panels of a picture: its heading, and sentences that a reader should know."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

from matplotlib.figure import Figure

# Letters to an inch of a note, and inches to its line.
LETTERS, LINE = 15, 0.17
# Letters to an inch of a heading, and of one with more words: the names of many effects fill more than a line.
LARGE, SMALL = 10, 13


def lines_of(notes: Sequence[str], width: float) -> list[str]:
    """Notes in lines that fit a picture so many inches wide."""
    return [line for note in notes for line in wrap(note, int(LETTERS * width))]


def head_and_foot(figure: Figure, name: Sequence[str], lines: Sequence[str]) -> float:
    """Writes the heading's lines and those of the notes; how high the notes reach, in inches."""
    width, height = figure.get_size_inches()
    short = max(map(len, name)) <= LARGE * width
    heads = name if short else [line for part in name for line in wrap(part, int(SMALL * width))]
    figure.suptitle("\n".join(heads), fontsize=11 if short else 8.5, y=1 - 0.1 / height, va="top")
    figure.text(0.12 / width, 0.08 / height, "\n".join(lines), fontsize=8, va="bottom", color="0.25")
    return 0.1 + LINE * len(lines)
