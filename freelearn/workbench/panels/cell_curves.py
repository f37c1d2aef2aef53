"""Curves behind a cell of a study's heat map: the run that was scored there, on the states of the test set."""

from __future__ import annotations

from pathlib import Path

import panel as pn
from bokeh.models import Slider

from freelearn.common.formats import error_in_words
from freelearn.data.sets import rows_of_set
from freelearn.queries.curves.curve_panels import panels_of
from freelearn.report.html.curve_charts import CurveCharts
from freelearn.workbench.panels.widgets import beside, heading, say, steady, wide, words
from freelearn.workbench.state.fitted import Fitted, fitted, written

WIDTH, HEIGHT = 312, 315


class CellCurves:
    """Hidden until a cell was clicked."""

    def __init__(self) -> None:
        self.said, self.group = words(), beside()
        self.fit: Fitted | None = None
        self.name = ""
        # Of each curve, by its number, what it is called.
        self.labels: dict[int, str] = {}
        self.charts: CurveCharts | None = None
        # Bokeh's own, as in the comparison.
        self.slider = Slider(start=0, end=1, step=1, value=0, show_value=False, title="kinematic state")
        self.slider.sizing_mode, self.slider.margin = "stretch_width", (0, 14)
        self.slider.on_change("value", lambda attr, old, new: self._draw())
        self.view = pn.Column(
            heading("Curves of the cell"), self.said, pn.pane.Bokeh(self.slider, sizing_mode="stretch_width"),
            self.group, sizing_mode="stretch_width", visible=False,
        )  # fmt: skip

    def show(self, run: Path, name: str, train: str, test: str, error: float, rows: int) -> None:
        """The state that a run predicts worst of a test set's, and by the slider every other. name: the model's; error,
        rows: of the cell. Raises UserError where the run is gone."""
        self.fit = fit = fitted(run, written(run))
        self.name = name
        samples = [int(n) for n in rows_of_set(fit.table, test)["sample"].unique()]
        self.labels = {
            curve: f"sample {sample}, {label}" for sample in samples for curve, label in fit.labels(sample).items()
        }
        self.charts = None
        of = f"{name}, trained on {train}, tested on {test}: E {error_in_words(error)} over {rows} rows."
        say(self.said, [f"{of} First the state that it predicts worst; drag the slider to the others."], "quiet")
        self.view.visible = bool(self.labels)
        if self.labels:
            self.slider.end = max(1, len(self.labels) - 1)
            place = list(self.labels).index(fit.worst(list(self.labels)))
            if self.slider.value == place:
                self._draw()
            self.slider.value = place

    def hide(self) -> None:
        """Of another study no cell is chosen yet."""
        self.view.visible = False

    def _draw(self) -> None:
        if self.fit is None or not self.labels:
            return
        curve = list(self.labels)[min(int(self.slider.value), len(self.labels) - 1)]
        self.slider.title = f"kinematic state ({self.labels[curve]})"
        rows = self.fit.rows(curve)
        measured = self.fit.table.iloc[rows]
        shown = panels_of(measured)
        if self.charts is None or tuple(self.charts.shown) != shown:
            self.charts = CurveCharts([self.name], WIDTH, HEIGHT, shown)
            for panel in self.charts.panels:
                steady(panel)
            self.group.objects = [wide(panel) for panel in self.charts.panels]
        self.charts.show(measured, {self.name: self.fit.predicted(rows)})
