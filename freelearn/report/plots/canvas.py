"""The figures that everything is drawn on, their notes, and sheets of several."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from freelearn.common.files import write_whole

# Figures without pyplot: no global state, a quicker import, and files that are whole or absent.


def new_figure(width: float, height: float, dpi: int = 110) -> Figure:
    """An empty figure of width × height inches."""
    figure = Figure(figsize=(width, height), dpi=dpi)
    FigureCanvasAgg(figure)
    return figure


def heading(title: str, simulated: bool) -> str:
    """A figure's title; simulated data always say so."""
    return f"{title} — simulated data" if simulated else title


def finish(axes: Axes, x: str, y: str) -> None:
    """Labels with units and a quiet grid."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.25, linewidth=0.6)
    axes.set_axisbelow(True)


def to_rgb(figure: Figure) -> np.ndarray:
    """The drawn figure, (H, W, 3) uint8."""
    # matplotlib declares no types for what its Agg canvas does.
    canvas: Any = figure.canvas
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def ranges(table: pd.DataFrame) -> dict[str, list[float]]:
    """The least and the largest number of each column that has any: what a picture says of itself in its Description,
    so that an old one can be told.

    >>> ranges(pd.DataFrame({"force_n": [1.0, -2.00004], "note": ["a", "b"]}))
    {'force_n': [-2.0, 1.0]}
    """
    numbers = table.select_dtypes("number").dropna(axis="columns", how="all")
    return {str(name): [float(f"{end:.4g}") for end in (of.min(), of.max())] for name, of in numbers.items()}


def save(figure: Figure, table: pd.DataFrame, path: Path) -> np.ndarray:
    """Writes the picture and, beside it, the table it was drawn from as a CSV of the same name; returns the drawn
    figure, (H, W, 3) uint8.

    Both are finished under other names first: a run killed half-way leaves the old pair, never half a file.
    """
    pixels = to_rgb(figure)
    said = {"Description": json.dumps(ranges(table))}

    def both(picture: Path) -> None:
        # Not Figure.savefig, which would draw it again.
        imsave(picture, pixels, format="png", dpi=figure.dpi, metadata=said)
        write_whole(path.with_suffix(".csv"), lambda numbers: table.to_csv(numbers, index=False))

    write_whole(path, both)
    return pixels


def save_all(figures: Mapping[str, tuple[Figure, pd.DataFrame]], folder: Path, writer: Any) -> list[Path]:
    """Saves each picture under its name in the folder, and in TensorBoard; the pictures' paths. writer: of
    tensorboard_log.event_file."""
    for name, (figure, table) in figures.items():
        writer.add_image(name, save(figure, table, folder / f"{name}.png"), dataformats="HWC")
    return [folder / f"{name}.png" for name in figures]


def save_picture(figure: Figure, table: pd.DataFrame, path: Path) -> None:
    """Writes the picture alone, where the table that it was drawn from has a file of its own."""
    pixels, said = to_rgb(figure), {"Description": json.dumps(ranges(table))}
    write_whole(path, lambda picture: imsave(picture, pixels, format="png", dpi=figure.dpi, metadata=said))


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


# Fields in rows and columns with color bars, placed by hand: matplotlib's placing takes room from the fields.

Place = tuple[float, float, float, float]

LEFT, BAR = 0.8, 0.15


@dataclass(frozen=True)
class Sheet:
    """Everything in inches. across, down: numbers of fields; wide, high: a field; apart, below: the room between two;
    right: beside the last one; top: over the highest; foot: under the lowest."""

    across: int
    down: int
    wide: float
    high: float
    apart: float
    below: float
    right: float
    top: float
    foot: float

    @property
    def width(self) -> float:
        """Of the figure."""
        return LEFT + self.across * self.wide + (self.across - 1) * self.apart + self.right

    @property
    def height(self) -> float:
        """Of the figure."""
        return self.top + self.down * self.high + (self.down - 1) * self.below + self.foot

    def field(self, column: int, row: int) -> Place:
        """Left, bottom, width and height of a field, as shares of the figure."""
        x, y = LEFT + column * (self.wide + self.apart), self.foot + (self.down - 1 - row) * (self.high + self.below)
        return x / self.width, y / self.height, self.wide / self.width, self.high / self.height

    def bar(self, column: int, row: int) -> Place:
        """The same of a color bar beside a field."""
        x, y, wide, high = self.field(column, row)
        return x + wide + 0.12 / self.width, y, BAR / self.width, high
