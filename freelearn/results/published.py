"""What the paper reports for its own eight samples, whose data are not public, and ours beside it. Errors E as
fractions."""

from __future__ import annotations

import pandas as pd

from freelearn.measurements.sets import CONSTITUENT_SET
from freelearn.results.formats import fixed, percent
from freelearn.results.tables import DisplayTable

# Sedal, Wineman, Gillespie & Remy, "Comparison and Experimental Validation of Predictive Models for Soft,
# Fiber-Reinforced Actuators", Section "Results".
PUBLISHED: dict[str, dict[str, float]] = {
    "linear": {"mean": 0.349, "range": 0.888, "diagonal": 0.214, "min": 0.0219},
    "continuum": {"mean": 0.181, "range": 0.326, "diagonal": 0.1687, "min": 0.0625, "max": 0.388},
    "mlp": {"mean": 0.296, "range": 1.897, "diagonal": 0.0551},
}

# What each figure is of a model's cells: every training set on every test set.
FIGURES = {"mean": "mean", "range": "range", "diagonal": "own set", "min": "least", "max": "most"}
# Cells named as those in which the difference may lie.
NAMED = 3


def beside_the_paper(summary: pd.DataFrame) -> DisplayTable | None:
    """Ours beside the paper's, where a model of the paper is among them; None without one. summary: of
    results.summary.summary.

    >>> ours = {"label": "continuum", "mean": 0.2, "diagonal": 0.1, "min": 0.05, "max": 0.4, "range": 0.35}
    >>> print(beside_the_paper(pd.DataFrame([ours])).rows[0])
    ('continuum', 'mean', '20.0', '18.1', '1.10')
    """
    rows = [
        [str(row["label"]), name, percent(row[figure], 1), percent(told, 1), fixed(row[figure] / told, 2)]
        for _, row in summary.iterrows()
        for figure, name in FIGURES.items()
        if (told := PUBLISHED.get(str(row["label"]), {}).get(figure)) is not None
    ]
    if not rows:
        return None
    return DisplayTable.of(
        ["model", "E over the map"], ["here %", "paper %", "here / paper"], rows, title="Beside the paper's maps",
        caption="The paper prints these figures of its maps and not their cells; what it leaves out has no row here.",
    )  # fmt: skip


def where_they_differ(cells: pd.DataFrame, summary: pd.DataFrame, simulated: bool) -> list[str]:
    """Sentences on what is alike and what is not: whose data, which model is best, and the cells that set the range.
    cells: of results.summary.cells."""
    known = summary[summary["label"].isin(PUBLISHED)].set_index("label")
    if known.empty:
        return []
    whose = "simulated actuators of the paper's designs" if simulated else "the samples of this table"
    lines = [f"The paper measured eight real samples, whose data are not public; here are {whose}."]
    for figure, where in (("mean", "over all cells"), ("diagonal", "on its own set")):
        told = {name: PUBLISHED[name][figure] for name in known.index}
        ours = known[figure].dropna()
        if len(ours) < 2:
            continue
        here, there = " < ".join(ours.sort_values().index), " < ".join(sorted(told, key=lambda name: told[name]))
        lines.append(f"E {where}, the best first: here {here}; paper {there}{' as well' if here == there else ''}.")
    for name in known.index:
        part = cells[(cells["label"] == name) & (cells["train"] != CONSTITUENT_SET)].nlargest(NAMED, "E")
        worst = "; ".join(f"{row.train} on {row.test} {percent(row.E, 0)} %" for row in part.itertuples())
        lines.append(f"Largest of {name}: {worst}.")
    return lines
