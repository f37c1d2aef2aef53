"""The numbers of the paper's discussion: how good each model is, where, and at what price."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.sets import overlap

CONSTITUENT = "constituent"


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Mean E, its standard deviation over seeds and count for each label, training and test set.

    Columns label, train, test, E, deviation (blank for one seed), seeds, best (least E of its cell).
    """
    good = table[table["error"] == ""]
    grouped = good.groupby(["label", "train", "test"], sort=False)["E"].agg(["mean", "std", "count"]).reset_index()
    grouped.columns = ["label", "train", "test", "E", "deviation", "seeds"]
    best = grouped.groupby(["train", "test"])["E"].transform("min")
    return grouped.assign(best=grouped["E"] == best)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row per label, errors as fractions.

    mean, deviation (over seeds, of the mean), min, max, range over all cells of fitted runs; diagonal: mean over cells
    tested on the training set itself; unseen: mean over cells whose test samples were not trained on; constituent:
    mean over cells with nothing fitted; parameters; best_share: share of cells in which no other label is better.
    """
    rows = []
    for label, part in cells(table).groupby("label", sort=False):
        jobs = table[(table["label"] == label) & (table["error"] == "") & (table["train"] != CONSTITUENT)]
        fitted = part[part["train"] != CONSTITUENT]
        unseen = np.array([not overlap(a, b) for a, b in zip(fitted["train"], fitted["test"], strict=True)], dtype=bool)
        rows.append(
            {
                "label": label,
                "mean": fitted["E"].mean(),
                "deviation": jobs.groupby("seed")["E"].mean().std(),
                "min": fitted["E"].min(),
                "max": fitted["E"].max(),
                "range": fitted["E"].max() - fitted["E"].min(),
                "diagonal": fitted.loc[fitted["train"] == fitted["test"], "E"].mean(),
                "unseen": fitted.loc[unseen, "E"].mean(),
                "constituent": part.loc[part["train"] == CONSTITUENT, "E"].mean(),
                "parameters": jobs["parameters"].max(),
                "best_share": fitted["best"].mean(),
                "cells": len(fitted),
            }
        )
    return pd.DataFrame(rows)
