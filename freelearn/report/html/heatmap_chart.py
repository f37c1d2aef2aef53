"""Error of every training set (across) on every test set (down)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
from bokeh.models import BasicTickFormatter, ColorBar, CustomJS, FixedTicker, LogColorMapper
from bokeh.palettes import Viridis256
from bokeh.plotting import figure

from freelearn.report.html.chart_canvas import chart, hover, source
from freelearn.report.tables.error_map import cell_text, error_range, mean_text, set_order

# The report of the cell that was chosen, in a tab of its own.
OPEN = "const link = source.data.link[source.selected.indices[0]]; if (link) window.open(link)"


def heatmap_chart(
    cells: pd.DataFrame,
    label: str,
    reports: Mapping[tuple[str, str, str], str] = MappingProxyType({}),
    tapped: Callable[[str, str], None] | None = None,
) -> figure:
    """One label's map. cells: of summary.cells, of all labels: they share the order of sets and the color scale.
    reports: where a click on a cell leads, by its label, training and test set. tapped: called instead, on a server,
    with the training and the test set of a cell that was clicked."""
    low, high = error_range(cells)
    across, down = set_order(cells["train"]), set_order(cells["test"])
    part = cells[(cells["label"] == label) & cells["E"].notna()]
    # The title has to fit above the narrowest.
    width, height = max(165 + 38 * len(across), 400), 150 + 30 * len(down)
    panel = chart(
        f"{label}: E [%]\n{mean_text(part)}", "training set", "test set", width, height,
        x_range=across, y_range=down[::-1],
    )  # fmt: skip
    # Small errors are bright.
    mapper = LogColorMapper(Viridis256[::-1], low=low, high=high)
    percent = 100 * part["E"]
    # As in the picture.
    dark = np.log(percent.clip(low, high) / low) > 0.58 * np.log(high / low)
    link = [reports.get((label, train, test), "") for train, test in zip(part["train"], part["test"], strict=True)]
    columns = {
        "link": link,
        "percent": percent,
        "text": percent.map(cell_text),
        "ink": np.where(dark, "white", "black"),
    }
    cells_shown = source(part.assign(**columns))
    squares = panel.rect(
        "train", "test", 0.97, 0.97, source=cells_shown,
        fill_color={"field": "percent", "transform": mapper}, line_color=None,
    )  # fmt: skip
    texts = panel.text(
        "train", "test", text="text", source=cells_shown, text_color="ink", text_align="center",
        text_baseline="middle", text_font_size="8pt",
    )  # fmt: skip
    tips = [("trained on", "@train"), ("tested on", "@test"), ("E", "@percent{0.00} %"), ("seeds", "@seeds")]
    hover(panel, [*tips, ("rows scored", "@n{0}")], [squares])
    if any(link) or tapped:
        open_it = CustomJS(args={"source": cells_shown}, code=OPEN)
        cells_shown.selected.js_on_change("indices", open_it)
        if tapped:
            pairs = list(zip(part["train"], part["test"], strict=True))
            cells_shown.selected.on_change("indices", lambda attr, old, new: tapped(*pairs[new[0]]) if new else None)
        panel.add_tools("tap")
        # The others stay as they are.
        squares.nonselection_glyph = texts.nonselection_glyph = None
        squares.selection_glyph = squares.glyph.clone()
        squares.selection_glyph.line_color, squares.selection_glyph.line_width = "black", 2.5
    panel.xaxis.major_label_orientation = 1.0
    panel.grid.visible = False
    ticks = [m * 10.0**e for e in range(-2, 4) for m in (1, 2, 5) if low <= m * 10.0**e <= high]
    bar = ColorBar(color_mapper=mapper, width=10, padding=4, ticker=FixedTicker(ticks=ticks))
    bar.formatter = BasicTickFormatter(use_scientific=False)
    panel.add_layout(bar, "right")
    return panel
