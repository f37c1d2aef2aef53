"""The numbers of the paper's discussion: how good each model is, where, and at what price."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.sets import CONSTITUENT_SET, overlap
from freelearn.results.formats import number, percent
from freelearn.results.tables import DisplayTable

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
    return DisplayTable.of(["model"], columns, rows, title="error E in %", caption=CAPTION)
