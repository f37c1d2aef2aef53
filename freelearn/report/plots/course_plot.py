"""How what is driven goes along the recordings of a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.common.formats import fixed, signed
from freelearn.data.logs import TIME
from freelearn.queries.next_measurements.courses import driven, held
from freelearn.records.plan_record import EXPECTED, Plan
from freelearn.report.plots.canvas import finish, heading, new_figure
from freelearn.report.tables.plan_tables import efficiency_text, expected_of, visits

# Recordings that are drawn, and how many stand beside each other.
MOST, ABREAST = 6, 3


def course_table(plan: Plan) -> pd.DataFrame:
    """What is drawn: a row for each sample of a recording, with what is imposed and the σ expected of it."""
    parts = visits(plan)[:MOST]
    shown = pd.concat(parts, ignore_index=True)
    names = dict.fromkeys(q.column for part in parts for q in driven(part))
    return shown[
        ["run", "sample", TIME, *(q.column for q in plan.bed.state if q.column not in names), *names, EXPECTED]
    ]


def courses(plan: Plan) -> Figure:
    """A field for each recording, the first MOST."""
    count = min(len(visits(plan)), MOST)
    lines = -(-count // ABREAST)
    figure = new_figure(max(5.2, 1.0 + 3.3 * min(count, ABREAST)), 1.3 + 2.4 * lines)
    simulated = bool(plan.about["data"].get("simulated"))
    title = heading(f"What to record next: {plan.goal} {' from '.join(plan.weakest.name)}", simulated)
    figure.suptitle(title, fontsize=10.5)
    axes = figure.subplots(lines, min(count, ABREAST), squeeze=False).ravel()
    for spare in axes[count:]:
        spare.set_visible(False)
    draw_courses(list(axes[:count]), plan)
    height = figure.get_figheight()
    figure.subplots_adjust(
        left=0.75 / figure.get_figwidth(),
        right=0.97,
        bottom=0.75 / height,
        top=1 - 0.75 / height,
        wspace=0.3,
        hspace=0.6,
    )
    figure.text(0.98, 0.02, f"{efficiency_text(plan)} of the best possible", ha="right", fontsize=8)
    return figure


def draw_courses(panels: Sequence[Axes], plan: Plan) -> None:
    """Draws the first recordings, one on each of the axes."""
    for axes, part in zip(panels, visits(plan), strict=False):
        time, names = part[TIME].to_numpy(np.float64), driven(part)
        apart = len({q.unit for q in names}) > 1
        for number, q in enumerate(names):
            value = part[q.column].to_numpy(np.float64)
            shown = 100 * (value - value.min()) / np.ptp(value) if apart else value
            axes.plot(time, shown, ".-", ms=3, lw=1, color=COLORS[number], label=q.symbol)
        if len(names) > 1:
            axes.legend(frameon=False, fontsize=7)
        places = [
            f"{q.symbol} {signed(float(part[q.column].iloc[0]), 3)}{q.suffix}" for q in plan.bed.state if q not in names
        ]
        where = ", ".join([f"sample {int(part['sample'].iloc[0])}", *places, *([held(part)] if held(part) else [])])
        axes.set_title(f"run {part['run'].iloc[0]}, {where}: {fixed(expected_of(part), 1)} σ", fontsize=8)
        label = "share of the way [%]" if apart else f"{names[0].name} [{names[0].unit}]"
        finish(axes, "time [s]", label)
