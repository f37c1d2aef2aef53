"""Where the rows of a plan lie, beside those that are measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.data.logs import is_log
from freelearn.records.plan_record import Plan
from freelearn.report.plots.canvas import finish, heading, new_figure, save
from freelearn.report.plots.course_plot import course_table, courses
from freelearn.report.tables.plan_tables import efficiency_text, place_table

# Points² of a mark of one σ, and of the smallest and the largest.
AREA, SMALLEST, LARGEST = 40.0, 25.0, 400.0


def draw_plan(plan: Plan, path: Path) -> None:
    """The picture, with its numbers beside it: places, or of a log how what is driven goes."""
    if is_log(plan.table):
        save(courses(plan), course_table(plan), path)
        return
    table = place_table(plan)
    save(places(plan, table), table, path)


def places(plan: Plan, table: pd.DataFrame) -> Figure:
    """A field for each sample over the two quantities that the bed imposes: measured states in gray, the plan's in
    color, as large as the σ expected of them, with the number of their rows. table: of plan_tables.place_table."""
    samples = sorted(table["sample"].unique())
    figure = new_figure(max(5.2, 1.2 + 3.0 * len(samples)), 4.2)
    simulated = bool(plan.about["data"].get("simulated"))
    weakest = " from ".join(plan.weakest.name)
    figure.suptitle(heading(f"Where to measure next: {plan.goal} {weakest}", simulated), fontsize=10.5)
    axes = figure.subplots(1, len(samples), sharex=True, sharey=True, squeeze=False)[0]
    figure.subplots_adjust(left=0.75 / figure.get_figwidth(), right=0.97, bottom=0.22, top=0.84, wspace=0.08)
    draw_places(list(axes), plan, table)
    figure.legend(*axes[-1].get_legend_handles_labels(), frameon=False, fontsize=8, loc="lower left", ncols=2)
    text = f"number of rows in each mark; area: expected σ; {efficiency_text(plan)} of the best possible"
    figure.text(0.98, 0.02, text, ha="right", fontsize=8)
    return figure


def draw_places(panels: Sequence[Axes], plan: Plan, table: pd.DataFrame) -> None:
    """Draws one sample on each of the axes. plan, table: as of `places`."""
    x, y = plan.bed.state
    samples = sorted(table["sample"].unique())
    for number, (one, sample) in enumerate(zip(panels, samples, strict=True)):
        part = table[table["sample"] == sample]
        old, new = part[part["rows"] == 0], part[part["rows"] > 0]
        one.plot(old[x.column], old[y.column], "o", color="0.75", ms=3, label="measured")
        area = (AREA * new["expected_z"]).clip(SMALLEST, LARGEST)
        one.scatter(new[x.column], new[y.column], area, color=COLORS[1], alpha=0.8, zorder=3)
        one.plot([], [], "o", color=COLORS[1], ms=6, label="to measure")
        for across, up, rows in zip(new[x.column], new[y.column], new["rows"], strict=True):
            one.annotate(f"{rows}", (across, up), ha="center", va="center", fontsize=7, color="white", zorder=4)
        one.set_title(f"sample {sample}", fontsize=9)
        finish(one, x.label, y.label if number == 0 else "")
