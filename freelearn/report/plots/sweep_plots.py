"""A sweep's pictures: error maps by model, and all at a glance."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from freelearn.common.display import COLORS
from freelearn.data.sets import CONSTITUENT_SET, overlap
from freelearn.report.plots.canvas import heading, new_figure, save_all
from freelearn.report.plots.heatmap_plots import TICKS, color_scale, heatmap, side_by_side
from freelearn.report.tables.error_map import caption
from freelearn.report.tables.sweep_tables import PUBLISHED
from freelearn.report.tensorboard_log import SWEPT, event_file

# Peak performance, generalization and size of the models of a sweep.

# Names of models side by side under the overview.
NAMES_IN_A_ROW = 4


def overview(summary: pd.DataFrame, simulated: bool) -> Figure:
    """Peak performance against generalization, and error against the number of parameters, one mark per label."""
    # Names stand below: beside the marks they would lie on each other.
    rows = -(-len(summary) // NAMES_IN_A_ROW)
    height = 4.3 + 0.22 * rows
    figure = new_figure(10.0, height)
    figure.suptitle(heading("Peak performance, generalization and size of the models", simulated), fontsize=11)
    figure.subplots_adjust(left=0.075, right=0.98, bottom=(0.62 + 0.22 * rows) / height, top=0.88, wspace=0.25)
    panels = (
        ("diagonal", "E on the training set's own test rows [%]", 100.0),
        ("parameters", "number of fitted parameters", 1.0),
    )
    for number, (column, label, factor) in enumerate(panels, 1):
        axes = figure.add_subplot(1, 2, number)
        for i, (_, row) in enumerate(summary.iterrows()):
            x = factor * row[column]
            color, marker = COLORS[i % len(COLORS)], "osD^vP*X"[i % 8]
            # Open marks over filled ones, larger: where both lie on one place both are seen.
            for which, fill in (("unseen", color), ("diagonal", "none")):
                if number == 1 and which == "diagonal":
                    continue
                name = row["label"] if number == 1 else None
                size = 8 if which == "unseen" else 11
                axes.plot(x, 100 * row[which], marker, color=color, mfc=fill, ms=size, mew=1.6, label=name, alpha=0.85)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(FixedLocator(TICKS))
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        if number == 2:
            axes.xaxis.set_major_locator(FixedLocator(sorted(summary[column].dropna().unique())))
        axes.margins(0.2)
        axes.grid(alpha=0.25, which="both", linewidth=0.6)
        axes.set_xlabel(label)
        axes.set_ylabel("E [%]" if number == 2 else "E on samples never trained on [%]")
        if number == 2:
            axes.set_title("filled: samples never trained on; open: the training set's own test rows", fontsize=8.5)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=min(len(labels), NAMES_IN_A_ROW), frameon=False, fontsize=9
    )
    return figure


# Every picture of a sweep, as files and in TensorBoard.

# More maps than this in one picture would be too small to read; each is also a picture of its own.
MOST_IN_ONE = 24
# Where TensorBoard finds a sweep as a whole.
TENSORBOARD = "tensorboard"


def draw_sweep(cells: pd.DataFrame, summary: pd.DataFrame, simulated: bool, out: Path) -> list[Path]:
    """Writes heatmap_<label>.png, heatmaps.png and overview.png, and the same for TensorBoard; returns their paths.

    cells, summary: as sweep_tables makes them."""
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
    # A folder for each model: TensorBoard opens empty where there are more runs than forty, as a sweep has.
    for label in labels:
        _log_errors(cells[cells["label"] == label], out / TENSORBOARD / _file_name(label))
    with event_file(out / TENSORBOARD) as writer:
        writer.add_custom_scalars(SWEPT)
        paths = save_all(figures, out, writer)
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
