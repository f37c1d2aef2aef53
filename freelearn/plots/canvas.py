"""Figures without pyplot: no global state, a quicker import, and files that are whole or absent."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe & Ito's colours, told apart by colour-blind readers; line styles and markers differ as well.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
LINES = ("-", "-.", ":", (0, (3, 1, 1, 1, 1, 1)))


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
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def save(figure: Figure, table: pd.DataFrame, path: Path) -> None:
    """Writes the picture and, beside it, the table it was drawn from as a CSV of the same name.

    Both are finished under other names first: a run killed half-way leaves the old pair, never half a file.
    """
    # The process number keeps two runs that write the same picture out of each other's unfinished files.
    picture = path.with_name(f".{path.name}.{os.getpid()}.part")
    numbers = path.with_name(f".{path.stem}.csv.{os.getpid()}.part")
    try:
        figure.savefig(picture, format="png")
        table.to_csv(numbers, index=False)
        os.replace(numbers, path.with_suffix(".csv"))
        os.replace(picture, path)
    finally:
        picture.unlink(missing_ok=True)
        numbers.unlink(missing_ok=True)
