"""Every picture of a sweep, as files and in TensorBoard."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from freelearn.measurements.sets import CONSTITUENT_SET, overlap
from freelearn.render.events import SWEPT, event_file
from freelearn.render.png.canvas import heading, save
from freelearn.render.png.heatmap import color_scale, heatmap, side_by_side
from freelearn.render.png.overview import overview
from freelearn.results.error_map import caption
from freelearn.results.published import PUBLISHED

# More maps than this in one picture would be too small to read; each is also a picture of its own.
MOST_IN_ONE = 24
# Where TensorBoard finds a sweep as a whole.
TENSORBOARD = "tensorboard"


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
    shown = labels[:MOST_IN_ONE]
    title = heading("Error of each training set on each test set", simulated)
    if len(shown) < len(labels):
        title += f" (first {len(shown)} of {len(labels)} models; the others: heatmap_*.png)"
    part = cells[cells["label"].isin(shown)]
    figures["heatmaps"] = side_by_side(part, shown, captions, title, norm), part
    if summary["unseen"].notna().any() and summary["diagonal"].notna().any():
        figures["overview"] = overview(summary, simulated), summary
    paths = []
    # A folder for each model: TensorBoard opens empty where there are more runs than forty, as a sweep has.
    for label in labels:
        _log_errors(cells[cells["label"] == label], out / TENSORBOARD / _file_name(label))
    with event_file(out / TENSORBOARD) as writer:
        writer.add_custom_scalars(SWEPT)
        for name, (figure, table) in figures.items():
            paths.append(out / f"{name}.png")
            writer.add_image(name, save(figure, table, paths[-1]), dataformats="HWC")
    return paths


def _log_errors(part: pd.DataFrame, folder: Path) -> None:
    """One model's errors in %, its training sets one after the other as steps."""
    fitted = part[part["train"] != CONSTITUENT_SET]
    with event_file(folder) as writer:
        for number, (train, row) in enumerate(fitted.groupby("train", sort=False)):
            unseen = [not overlap(str(train), test) for test in row["test"]]
            each = {"own_set": row["test"] == train, "unseen": unseen, "all_sets": row["E"].notna()}
            for name, inside in each.items():
                error = row.loc[inside, "E"].mean()
                if pd.notna(error):
                    writer.add_scalar(f"sweep_error_percent/{name}", 100 * error, number)


def _file_name(label: str) -> str:
    return re.sub(r"[^\w+.-]+", "_", label)
