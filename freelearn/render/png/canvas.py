"""Figures without pyplot: no global state, a quicker import, and files that are whole or absent."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from freelearn.files import write_whole


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


def save_picture(figure: Figure, table: pd.DataFrame, path: Path) -> None:
    """Writes the picture alone, where the table that it was drawn from has a file of its own."""
    pixels, said = to_rgb(figure), {"Description": json.dumps(ranges(table))}
    write_whole(path, lambda picture: imsave(picture, pixels, format="png", dpi=figure.dpi, metadata=said))
