"""What came out, as pictures with their numbers beside them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.display import COLORS
from freelearn.report.plots.canvas import finish, new_figure, save

# Ends of the classes of slips by size, in the sensor's standard deviations.
EDGES = (0, 2, 4, 6, 8, 12, 20, 50, 200, np.inf)
CLASSES = [f"{low:g}–{high:g}" for low, high in pairwise(EDGES[:-1])] + [f"≥ {EDGES[-2]:g}"]


def wilson(share: pd.Series, count: pd.Series) -> tuple[pd.Series, pd.Series]:
    """Ends of the 68 % intervals of shares (Wilson 1927), which stay between 0 and 1 and are never empty."""
    middle = (share + 0.5 / count) / (1 + 1 / count)
    half = np.sqrt(share * (1 - share) / count + 0.25 / count**2) / (1 + 1 / count)
    return np.minimum(middle - half, share), np.maximum(middle + half, share)


def recovery(series: dict[str, pd.DataFrame], out: Path) -> None:
    """Share of right answers against the size of one hidden effect; series: name → results of one hidden effect."""
    parts = []
    for name, one in series.items():
        if len(one):
            rates = one.groupby("size")["right"].agg(["mean", "size"]).rename(columns={"size": "sets"})
            low, high = wilson(rates["mean"], rates["sets"])
            parts.append(rates.reset_index().assign(data=name, low=low.to_numpy(), high=high.to_numpy()))
    if not parts:
        return
    figure = new_figure(6.4, 4.2)
    axes = figure.add_axes((0.12, 0.15, 0.84, 0.73))
    for number, rates in enumerate(parts):
        error = [100 * (rates["mean"] - rates["low"]), 100 * (rates["high"] - rates["mean"])]
        label = f"{rates['data'].iloc[0]} ({rates['sets'].sum()} sets)"
        marker, at = "os^D"[number % 4], rates["size"] * 1.03**number
        axes.errorbar(at, 100 * rates["mean"], error, fmt=f"{marker}-", color=COLORS[number], capsize=3, label=label)
    axes.axhline(95, color="0.5", linestyle="--", linewidth=1)
    axes.set_xscale("log")
    sizes = sorted({size for rates in parts for size in rates["size"]})
    axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axes.minorticks_off()
    axes.set_ylim(0, 104)
    axes.legend(loc="lower right", fontsize=8)
    finish(axes, "size of the hidden effect after refitting [σ]", "right effect or class of ≤ 3 [%]")
    figure.suptitle("Recovery of one hidden effect — simulated data", fontsize=11)
    save(figure, pd.concat(parts, ignore_index=True), out / "recovery.png")


def detection(slips: pd.DataFrame, out: Path) -> None:
    """Share of slipped rows that were suspected against the slip's size. slips: sensor_sigmas, kind, found."""
    if not len(slips):
        return
    group = pd.cut(slips["sensor_sigmas"], EDGES, right=False, labels=CLASSES)
    rates = slips.groupby(group, observed=False)["found"].agg(["mean", "size"]).reset_index()
    rates = rates.rename(columns={"mean": "found", "size": "slips", "sensor_sigmas": "size"})
    figure = new_figure(6.4, 4.0)
    axes = figure.add_axes((0.12, 0.16, 0.84, 0.72))
    place = np.arange(len(rates))
    axes.bar(place, 100 * rates["found"].fillna(0), color=COLORS[0])
    for x, found, count in zip(place, rates["found"].fillna(0), rates["slips"], strict=True):
        axes.text(x, 100 * found + 1.5, f"{count}", ha="center", fontsize=8)
    axes.axhline(95, color="0.5", linestyle="--", linewidth=1)
    axes.set_xticks(place, [str(label) for label in rates["size"]])
    axes.set_ylim(0, 112)
    finish(axes, "size of the slip [standard deviations of the load cell]", "found [%]")
    figure.suptitle("Slipped readings found, of how many — simulated data", fontsize=11)
    save(figure, rates, out / "slips.png")


def confusion(one: pd.DataFrame, out: Path) -> None:
    """What was first named, by what was hidden; one: results of one hidden effect of 8 σ and more."""
    if not len(one):
        return
    hidden = sorted({r[0] for r in one["hidden"]})
    columns = [*hidden, "adequate", "undecided", "unexplained"]
    counts = pd.DataFrame(0.0, index=hidden, columns=columns)
    for _, r in one.iterrows():
        names = [group[0] for group in r["classes"]] if r["verdict"] in ("named", "class") else [r["verdict"]]
        for name in names:
            if name in counts.columns:
                counts.loc[r["hidden"][0], name] += 1 / len(names)
    shares = counts.div(counts.sum(1), axis=0)
    figure = new_figure(9.0, 7.6)
    axes = figure.add_axes((0.21, 0.24, 0.72, 0.69))
    image = axes.imshow(100 * shares, cmap="Blues", vmin=0, vmax=100, aspect="auto")
    for row, column in np.argwhere(shares.to_numpy() > 0):
        share = 100 * shares.iat[row, column]
        axes.text(column, row, f"{share:.0f}", ha="center", va="center", fontsize=6, color="wk"[int(share < 60)])
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(hidden)), hidden, fontsize=8)
    axes.set_xlabel("first named")
    axes.set_ylabel("hidden (8 σ and more)")
    figure.colorbar(image, ax=axes, label="share of data sets [%]")
    figure.suptitle("What was hidden and what was named — simulated data", fontsize=11)
    save(figure, shares.reset_index(names="hidden"), out / "confusion.png")
