"""The pictures of a run, a search and a plan: drawn as the commands draw them, on matplotlib axes.

Each takes `ax` and returns what it drew on: one Axes, or an array of them where a picture has a panel for each measured
quantity; `ax` then is as many of them, or one with `quantity` to say which. Nothing is shown or written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.common.formats import MINUS
from freelearn.data.logs import RUN, is_log
from freelearn.data.sets import rows_of_set
from freelearn.queries.curves.curve_panels import CurvePanel, measured_points, panels_of
from freelearn.queries.curves.curve_rows import measured_quantities, plane
from freelearn.queries.curves.log_spectra import log_spectra
from freelearn.queries.curves.log_traces import worst_recording
from freelearn.queries.curves.model_curves import BAND, StateCurves, state_curves
from freelearn.queries.curves.shown_states import pick_states, state_title
from freelearn.records.discovery import trail_numbers
from freelearn.report.tables.plan_tables import place_table, visits
from freelearn.report.tables.ranking_tables import ranking_numbers
from freelearn.report.tables.residual_tables import Limits, Strip, drawn, residual_table, scale_limits, shown_samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from freelearn.queries.fitted_model import FittedModel
    from freelearn.records.plan_record import Plan

Panel = TypeVar("Panel")
# Axes as given, and as returned.
Given = Any
# Inches of a panel.
WIDE, HIGH = 4.75, 4.2
# Letters of a heading to an inch.
LETTERS = 11
STATES = ("best", "middling", "worst")


class Search(Protocol):
    """What is drawn of a search."""

    @property
    def content(self) -> Any:
        """discovery.json."""

    def trusted(self, when: str) -> pd.DataFrame:
        """The rows looked at with predictions, suspected readings marked."""

    @property
    def state_curves(self) -> list[StateCurves]:
        """Measured rows with curves at a few states."""


class RunPlots:
    """Of a fit: `run.plot.parity()` and so on."""

    def __init__(self, run: FittedModel) -> None:
        self._run = run

    def parity(self, ax: Given = None, quantity: str | None = None) -> Any:
        """Predicted against measured, a panel for each measured quantity: force, moment or what else."""
        return _parity(self._own, ax, quantity, self._title)

    def residuals(self, ax: Given = None, quantity: str | None = None) -> Any:
        """Measured − predicted over what the bed imposes: where the model is wrong, and by how much."""
        return _residuals(self._own, ax, quantity, self._title, None)

    def curves(
        self, state: Literal["best", "middling", "worst"] = "worst", ax: Given = None, panel: str | None = None
    ) -> Any:
        """Measured points and the model's curve with its 95 % band at the state that is predicted best, worst, or
        between: panels F–P, M–P and F–M, or those of what else the bed measures."""
        picked = pick_states(self._own)
        if state not in STATES:
            raise UserError(f"state = {state!r} is not possible: choose {', '.join(STATES)}.")
        if not picked:
            raise UserError("No state has rows enough for a curve.")
        place = picked[min(STATES.index(state), len(picked) - 1)]
        run = self._run
        ((measured, lines),) = state_curves({run.title: run.model}, self._own, [place], bands={run.title: run.bands})
        return _curves(measured, lines, ax, panel, self._named(f"{self._what}: {state_title(measured)}"))

    def recording(self, ax: Given = None) -> Any:
        """Of a log the recording that is predicted worst: the pressure, then each measured quantity beside the model,
        over time."""
        from freelearn.report.plots.log_plots import draw_recording

        rows = worst_recording(self._log)[0]
        axes = _axes(ax, 1 + len(measured_quantities(rows)), self._named(f"{self._what}: run {rows[RUN].iloc[0]}"))
        draw_recording(axes, rows)
        return _returned(axes)

    def loops(self, ax: Given = None) -> Any:
        """Of a log the loops of what was measured over the pressure, colored by how fast that changes: those of the
        sample whose recording is predicted worst."""
        from freelearn.report.plots.log_plots import draw_loops

        sample = worst_recording(self._log)[1]
        axes = _axes(ax, len(measured_quantities(sample)), self._title)
        draw_loops(axes, sample)
        return _returned(axes)

    def spectra(self, ax: Given = None) -> Any:
        """What is left of a log by its frequency, beside the noise that was stated: what rises above it lasts."""
        from freelearn.report.plots.log_plots import draw_spectra

        spectra = log_spectra(self._run.model, self._log, self._run.run.accuracy)
        if not spectra:
            raise UserError("No recording has samples enough for a spectrum.")
        axes = _axes(ax, len(spectra), self._title)
        draw_spectra(axes, spectra)
        return _returned(axes)

    @property
    def _log(self) -> pd.DataFrame:
        own = self._own
        if not is_log(own):
            raise UserError("The table is no log: it needs time_s and run, see docs/logs.md.")
        return own

    def heatmap(self, ax: Given = None) -> Axes:
        """E on each test set: the column of a sweep's map that this run is."""
        from freelearn.report.plots.heatmap_plots import add_bar_beside, color_scale, draw_map

        tests = self._run.run.content.get("tests", {})
        cells = pd.DataFrame.from_dict(tests, orient="index").rename_axis("test").reset_index()
        cells = cells.assign(train=str(self._run.run.content["train"]))
        if "E" not in cells or not cells["E"].notna().any():
            raise UserError("Nothing was scored, so there is no error to draw.")
        cells = cells.astype({"E": float})
        (axes,) = _axes(ax, 1, self._title)
        norm = color_scale(cells)
        draw_map(axes, cells, norm)
        add_bar_beside(axes, norm)
        return axes

    @property
    def _own(self) -> pd.DataFrame:
        """Rows of the samples that were fitted; all where nothing was."""
        run = self._run.run
        fitted = run.content.get("fit") != "none"
        return rows_of_set(run.table, str(run.content["train"])).reset_index(drop=True) if fitted else run.table

    @property
    def _what(self) -> str:
        return f"{self._run.title} fitted on {self._run.run.content['train']}"

    @property
    def _title(self) -> str:
        return self._named(self._what)

    def _named(self, title: str) -> str:
        return _heading(title, self._run.run.content)


class FoundPlots:
    """Of a search: `found.plot.staircase()` and so on."""

    def __init__(self, found: Search) -> None:
        self._found = found

    def staircase(self, ax: Given = None) -> Axes:
        """The error on held-out states, from the model alone to the one that was found, above the noise floor."""
        from freelearn.report.plots.discovery_plots import draw_staircase

        trail = trail_numbers(self._found.content)
        (axes,) = _axes(ax, 1, self._named("Error on held-out kinematic states"), wide=max(5.5, 2.2 + 1.5 * len(trail)))
        draw_staircase(axes, trail)
        return axes

    def ranking(self, ax: Given = None) -> Axes:
        """How much each effect of the library would explain of the first model's misfit."""
        from freelearn.report.plots.discovery_plots import draw_ranking

        candidates = self._found.content["candidates"]
        before, after = ranking_numbers(candidates), ranking_numbers(candidates, len(self._found.content["trail"]) - 1)
        if not len(before):
            raise UserError("No effect was tested, so there is none to rank: see found.candidates.")
        later = after if len(self._found.content["trail"]) > 1 and len(after) else None
        high = 1.8 + 0.27 * len(before)
        (axes,) = _axes(ax, 1, self._named("What each effect would explain"), wide=8.0, high=high)
        draw_ranking(axes, before, later)
        axes.legend(frameon=False, fontsize=8.5)
        return axes

    def residuals(
        self, when: Literal["before", "after"] = "after", ax: Given = None, quantity: str | None = None
    ) -> Any:
        """Measured − predicted over what the bed imposes, of the first model (before) or the last one (after), on the
        colors of both."""
        both = [self._found.trusted(each) for each in ("before", "after")]
        table = self._found.trusted(when)
        limits = scale_limits(both, plane(both[0]), measured_quantities(both[0]))
        return _residuals(table, ax, quantity, self._named(when), limits)

    def curves(self, number: int = 1, ax: Given = None, panel: str | None = None) -> Any:
        """Measured points with the curves of the first and the last model. number: 1 a middling state, 2 that at which
        the first model is worst, 3 that of the worst suspect, where there is one."""
        curves = self._found.state_curves
        if not 1 <= number <= len(curves):
            raise UserError(f"number = {number} is not possible: choose 1 … {len(curves)}.")
        measured, lines = curves[number - 1]
        return _curves(measured, lines, ax, panel, self._named(state_title(measured)))

    def parity(self, ax: Given = None, quantity: str | None = None) -> Any:
        """Predicted by the last model against measured."""
        return _parity(self._found.trusted("after"), ax, quantity, self._named("after"))

    def _named(self, title: str) -> str:
        return _heading(title, self._found.content)


class PlanPlots:
    """Of a plan: `plan.plot.places()`."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan

    def places(self, ax: Given = None) -> Any:
        """Where the rows lie beside those that are measured: a panel for each sample. Of a log how what is driven goes:
        a panel for each recording."""
        from freelearn.report.plots.course_plot import MOST, draw_courses
        from freelearn.report.plots.plan_plot import draw_places

        if is_log(self._plan.table):
            count = min(len(visits(self._plan)), MOST)
            axes = _axes(ax, count, _heading("What to record next", self._plan.about))
            draw_courses(axes, self._plan)
            return _returned(axes)
        table = place_table(self._plan)
        samples = sorted(table["sample"].unique())
        axes = _axes(ax, len(samples), _heading("Where to measure next", self._plan.about))
        draw_places(axes, self._plan, table)
        return _returned(axes)


def _parity(table: pd.DataFrame, ax: Given, quantity: str | None, title: str) -> Any:
    from freelearn.report.plots.simple_plots import draw_parity

    shown = _chosen(measured_quantities(table), lambda each: each.name, quantity)
    axes = _axes(ax, len(shown), title)
    draw_parity(axes, table, shown)
    return _returned(axes)


def _residuals(table: pd.DataFrame, ax: Given, quantity: str | None, title: str, limits: Limits | None) -> Any:
    from freelearn.report.plots.residual_plots import colorbar_beside, draw_residuals, frame

    over, every = plane(table), measured_quantities(table)
    shown = _chosen(every, lambda each: each.name, quantity)
    ends = scale_limits([table], over, every) if limits is None else limits
    samples, _ = shown_samples(table)
    fields, _ = drawn(residual_table(table[table["sample"].isin(samples)].reset_index(drop=True), over))
    strip = Strip(fields, samples, over)
    axes = _axes(ax, len(shown), title, wide=max(WIDE + 0.6, 2.5 + 1.6 * len(samples)))
    for one, each in zip(axes, shown, strict=True):
        frame(strip, one, bottom=True)
        top = draw_residuals(one, strip, each, ends, len(samples) <= 1, common=limits is not None)
        colorbar_beside(one, top, each, alone=len(samples) <= 1)
    return _returned(axes)


def _curves(measured: pd.DataFrame, lines: Mapping[str, pd.DataFrame], ax: Given, panel: str | None, title: str) -> Any:
    from matplotlib.patches import Patch

    from freelearn.report.plots.curve_plots import draw_curves

    panels: Sequence[CurvePanel] = _chosen(panels_of(measured), lambda each: each.title, panel)
    axes = _axes(ax, len(panels), title)
    shown = measured_points(measured)
    banded = [
        draw_curves(one, shown, lines, each, first=each is panels[0]) for one, each in zip(axes, panels, strict=True)
    ]
    handles, labels = axes[0].get_legend_handles_labels()
    if any(banded):
        handles, labels = [*handles, Patch(color="gray", alpha=0.3, lw=0)], [*labels, BAND]
    if ax is None:
        # Below: inside the panels every corner may hold data.
        figure: Any = axes[0].get_figure()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    else:
        axes[0].legend(handles, labels, frameon=False, fontsize=8)
    return _returned(axes)


def _chosen(every: Sequence[Panel], name: Callable[[Panel], str], wanted: str | None) -> Sequence[Panel]:
    """All panels, or the one that is asked for. Raises UserError."""
    chosen = [each for each in every if wanted in (None, name(each))]
    if not chosen:
        raise UserError(f"There is no panel {wanted!r}: choose {', '.join(name(each) for each in every) or 'none'}.")
    return chosen


def _axes(ax: Given, count: int, title: str, wide: float = WIDE, high: float = HIGH) -> list[Axes]:
    """The axes that are given, or those of a new figure. Raises UserError where these are not as many as panels."""
    if ax is None:
        # The one module with a global state, which is what shows a figure at the end of a notebook's cell.
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=(wide * count, high), layout="constrained")
        figure.suptitle("\n".join(wrap(title.replace("-", MINUS), int(LETTERS * wide * count))), fontsize=11)
        return list(np.ravel(figure.subplots(1, count)))
    axes = list(np.ravel(ax))
    if len(axes) != count:
        raise UserError(f"This picture has {count} panels and ax has {len(axes)}: give as many, or name one panel.")
    return axes


def _returned(axes: list[Axes]) -> Any:
    return axes[0] if len(axes) == 1 else np.array(axes, dtype=object)


def _heading(title: str, content: Mapping[str, Any]) -> str:
    from freelearn.report.plots.canvas import heading

    return heading(title, bool((content.get("data") or {}).get("simulated")))
