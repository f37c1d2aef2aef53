"""Many runs in a few numbers: how good each model is, beside the paper's, and how far parameters move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.common.display import DisplayTable
from freelearn.common.formats import error_percent, fixed, number, percent
from freelearn.data.columns import DESIGN
from freelearn.data.sets import CONSTITUENT_SET, overlap
from freelearn.records.run import Run
from freelearn.records.sweep_records import RunRecord


class Scores(NamedTuple):
    """Errors E, as fractions; None where nothing was tested. own: on the training set's own test rows; unseen: mean
    over test sets of samples never trained on; mean, median: over all test sets."""

    own: float | None
    unseen: float | None
    mean: float | None
    median: float | None


def scores(run: Run) -> Scores:
    """Of a run's test sets those with a finite error."""
    errors = {name: error.E for name, error in run.errors.items() if np.isfinite(error.E)}
    fitted = run.train != CONSTITUENT_SET
    unseen = [value for name, value in errors.items() if fitted and not overlap(run.train, name)]
    every = list(errors.values())
    return Scores(
        errors.get(run.train) if fitted else None,
        float(np.mean(unseen)) if unseen else None,
        float(np.mean(every)) if every else None,
        float(np.median(every)) if every else None,
    )


CAPTION = (
    "own set: tested on the training set's own test rows; unseen: on samples never trained on; size: fitted "
    "parameters; % best: share of cells in which no other is better, of those that answer every row there: a model "
    "that leaves rows unanswered is scored on fewer, and is best nowhere"
)


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Mean E, its standard deviation over seeds and count for each label, training and test set.

    Columns label, train, test, E, deviation (blank for one seed), seeds, n (mean number of rows scored), complete
    (scored on as many rows as any other label of the cell, at every seed), best (least E of the complete ones).
    table: of collect.collect.
    """
    good = table[table["error"] == ""]
    most = good.groupby(["train", "test", "seed"])["n"].transform("max")
    good = good.assign(complete=good["n"] == most)
    grouped = good.groupby(["label", "train", "test"], sort=False)
    each = grouped["E"].agg(["mean", "std", "count"]).set_axis(["E", "deviation", "seeds"], axis=1)
    each = each.assign(n=grouped["n"].mean(), complete=grouped["complete"].all()).reset_index()
    # An error over fewer rows, those that the model can answer, compares with no other.
    scored = each["E"].where(each["complete"])
    least = scored.groupby([each["train"], each["test"]]).transform("min")
    return each.assign(best=scored == least)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row per label, errors as fractions.

    mean, median, deviation (over seeds, of the mean), min, max, range over all cells of fitted runs; diagonal: mean
    over cells tested on the training set itself; unseen: mean over cells whose test samples were not trained on, and
    unseen_median; constituent: mean over cells with nothing fitted; parameters; best_share: share of cells in which no
    other label is better, see `cells`.
    """
    rows = []
    for label, part in cells(table).groupby("label", sort=False):
        jobs = table[(table["label"] == label) & (table["error"] == "") & (table["train"] != CONSTITUENT_SET)]
        fitted = part[part["train"] != CONSTITUENT_SET]
        unseen = np.array([not overlap(a, b) for a, b in zip(fitted["train"], fitted["test"], strict=True)], dtype=bool)
        rows.append(
            {
                "label": label,
                "mean": fitted["E"].mean(),
                "median": fitted["E"].median(),
                "deviation": jobs.groupby("seed")["E"].mean().std(),
                "min": fitted["E"].min(),
                "max": fitted["E"].max(),
                "range": fitted["E"].max() - fitted["E"].min(),
                "diagonal": fitted.loc[fitted["train"] == fitted["test"], "E"].mean(),
                "unseen": fitted.loc[unseen, "E"].mean(),
                "unseen_median": fitted.loc[unseen, "E"].median(),
                "constituent": part.loc[part["train"] == CONSTITUENT_SET, "E"].mean(),
                "parameters": jobs["parameters"].max(),
                "best_share": fitted["best"].mean(),
                "cells": len(fitted),
            }
        )
    return pd.DataFrame(rows)


def summary_table(numbers: pd.DataFrame) -> DisplayTable:
    """The discussion's numbers; the rest of them is in summary.csv. numbers: of `summary`."""
    headings = {"mean": "mean", "median": "median", "diagonal": "own set", "unseen": "unseen"}
    rows = []
    for _, row in numbers.iterrows():
        shown = [percent(row[column], 1) for column in headings]
        rows.append([row["label"], *shown, percent(row["best_share"], 0), number(row["parameters"], 6)])
        if np.isfinite(row["constituent"]):
            rows.append([f"{row['label']}, constituents", percent(row["constituent"], 1), *["–"] * 4, "0"])
    columns = [*headings.values(), "% best", "size"]
    return DisplayTable.from_rows(["model"], columns, rows, title="error E in %", caption=CAPTION)


# What the paper reports for its own eight samples, whose data are not public, and ours beside it. Errors E as
# fractions.

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
    sweep_tables.summary.

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
    return DisplayTable.from_rows(
        ["model", "E over the map"], ["here %", "paper %", "here / paper"], rows, title="Beside the paper's maps",
        caption="The paper prints these figures of its maps and not their cells; what it leaves out has no row here.",
    )  # fmt: skip


def where_they_differ(cells: pd.DataFrame, summary: pd.DataFrame, simulated: bool) -> list[str]:
    """Sentences on what is alike and what is not: whose data, which model is best, and the cells that set the range.
    cells: of sweep_tables.cells."""
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
        worst = "; ".join(f"{row.train} on {row.test} {error_percent(row.E, 0)} %" for row in part.itertuples())
        lines.append(f"Largest of {name}: {worst}.")
    return lines


COLUMNS = ["model", "train", "seed", "parameter", "value", "stderr", "unit"]


def fitted_parameters(records: Sequence[RunRecord]) -> pd.DataFrame:
    """One row per fitted run and physical parameter, in COLUMNS (SI); weights of a network have no unit and no row."""
    rows = [
        [record.title, record.train, record.seed, e.name, e.value, e.stderr, e.unit]
        for record in records
        for e in record.estimates
        if e.unit and record.method != "none"
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def parameter_spread(fitted: pd.DataFrame) -> pd.DataFrame:
    """How far each parameter moves between runs: least, median and largest value, number of fits, and the largest over
    the least. fitted: of fitted_parameters."""
    moved = fitted.groupby(["model", "parameter", "unit"], sort=False)["value"].agg(["min", "median", "max", "size"])
    moved["max / min"] = (moved["max"] / moved["min"]).where(moved["min"] > 0)
    return moved.rename(columns={"size": "fits"}).reset_index()


def design_table(table: pd.DataFrame) -> pd.DataFrame:
    """The actuators of a measurement table, by sample: design, rows and un-buckled rows."""
    counts = table.groupby("sample")["buckled"].agg(rows="size", unbuckled=lambda buckled: int((buckled == 0).sum()))
    designs = table[["sample", *DESIGN]].drop_duplicates("sample").sort_values("sample")
    return designs.merge(counts, left_on="sample", right_index=True)
