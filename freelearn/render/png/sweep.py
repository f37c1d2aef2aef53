"""Every picture of a sweep, as files and in TensorBoard."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from torch.utils.tensorboard import SummaryWriter

from freelearn.render.png.canvas import heading, save, to_rgb
from freelearn.render.png.heatmap import color_scale, heatmap, side_by_side
from freelearn.render.png.overview import overview
from freelearn.results.error_map import caption
from freelearn.results.published import PUBLISHED

# More maps than this side by side are too small to read.
MOST_SIDE_BY_SIDE = 5


def draw_sweep(cells: pd.DataFrame, summary: pd.DataFrame, simulated: bool, out: Path) -> list[Path]:
    """Writes heatmap_<label>.png, heatmaps.png and overview.png, and the same for TensorBoard; returns their paths.

    cells, summary: as results.summary makes them."""
    norm = color_scale(cells)
    labels = list(summary["label"])
    figures: dict[str, tuple[Figure, pd.DataFrame]] = {}
    note = "simulated data" if simulated else "measured data"
    for label in labels:
        part = cells[cells["label"] == label]
        title = f"{label}: error of each training set on each test set"
        figures[f"heatmap_{_file_name(label)}"] = heatmap(part, title, norm, note), part
    captions = {
        row["label"]: caption(row, PUBLISHED.get(str(row["label"])), simulated) for _, row in summary.iterrows()
    }
    shown = labels[:MOST_SIDE_BY_SIDE]
    title = heading("Error of each training set on each test set", simulated)
    part = cells[cells["label"].isin(shown)]
    figures["heatmaps"] = side_by_side(part, shown, captions, title, norm), part
    if summary["unseen"].notna().any() and summary["diagonal"].notna().any():
        figures["overview"] = overview(summary, simulated), summary
    paths = []
    board = out / "tensorboard"
    # What an earlier gathering of this folder left would show beside the new pictures.
    for old in board.glob("events.out.tfevents.*"):
        old.unlink(missing_ok=True)
    with SummaryWriter(str(board)) as writer:
        for name, (figure, table) in figures.items():
            paths.append(out / f"{name}.png")
            save(figure, table, paths[-1])
            writer.add_image(name, to_rgb(figure), dataformats="HWC")
    return paths


def _file_name(label: str) -> str:
    return re.sub(r"[^\w+.-]+", "_", label)
