"""What the benchmark's results add up to, in words and pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, new_figure, save

MOST_IN_CLASS = 3
# What has no potential, and what depends on the history, of all that is hidden: the truth that the screens are held
# against. What happens as time goes by breaks reciprocity, and shows between rising and falling pressure if quick.
WITHOUT_POTENTIAL = {
    *("friction_hysteresis", "relaxation", "stress_softening", "force_gain", "moment_gain", "sensor_crosstalk"),
    *("sensor_drift", "bent_force_cell", "temperature_swing", "bulging_caps", "zero_jump"),
}
OF_HISTORY = {"friction_hysteresis", "relaxation", "stress_softening"}
AFFIRMED = {"reciprocity": WITHOUT_POTENTIAL, "rising against falling pressure": OF_HISTORY}


def right(result: dict) -> bool:
    """Every hidden effect is named, or stands in a class of at most three; nothing else is named."""
    if result["verdict"] not in ("named", "class") or len(result["classes"]) != len(result["hidden"]):
        return False
    left = list(result["hidden"])
    for group in result["classes"]:
        match = next((h for h in left if h in group), None)
        if match is None or len(group) > MOST_IN_CLASS:
            return False
        left.remove(match)
    return not left


def contradicted(result: dict, screen: str) -> bool:
    """Whether what the screen said of a data set contradicts what was hidden in it.

    Reciprocity kept denies nothing: a wrong gain keeps it too where the fluid's thrust is most of the load. Loads that
    do not differ deny friction above the limit that is told with it: half of the largest difference."""
    shows, hidden = result["screens"].get(screen), set(result["hidden"])
    if shows:
        return not hidden & AFFIRMED[screen]
    if shows is None or screen == "reciprocity" or "friction_hysteresis" not in hidden:
        return False
    rubs = [result["truth"][f"friction_hysteresis.{load}"] for load in ("force", "moment")]
    return any(2 * f > most for f, most in zip(rubs, result["hysteresis_at_most"], strict=True))


def report(results: list[dict], out: Path) -> None:
    """Prints the rates against their targets and draws recovery.png and confusion.png."""
    console = Console(width=110)
    frame = pd.DataFrame(results)
    frame["right"] = [right(r) for r in results]
    table = Table(title=f"{len(results)} data sets", title_justify="left")
    for heading in ("what", "sets", "rate %", "target"):
        table.add_column(heading, justify="left" if heading == "what" else "right")

    def line(what: str, chosen: pd.DataFrame, good: pd.Series, target: str) -> None:
        if len(chosen):
            table.add_row(what, str(len(chosen)), f"{100 * good.mean():.1f}", target)

    none = frame[frame["kind"] == "none"]
    line("effect wrongly named on effect-free data", none, none["effects"].map(bool), "≤ 5")
    line("effect-free data called adequate", none, none["verdict"] == "adequate", "")
    one = frame[frame["kind"] == "one"]
    for size, target in ((4, ""), (8, "≥ 95"), (15, "≥ 99"), (30, "")):
        part = one[one["size"] == size]
        line(f"right effect or class of ≤ 3, {size} σ", part, part["right"], target)
    pair = frame[frame["kind"] == "pair"]
    line("both of a pair, 15 σ", pair, pair["right"], "≥ 85")
    outside = frame[frame["kind"] == "outside"]
    for size in (15, 30):
        part = outside[outside["size"] == size]
        line(f"outside the library, unexplained, {size} σ", part, part["verdict"] == "unexplained", "≥ 90")
    found = frame[frame["right"] & (frame["kind"] != "none")]
    if len(found):
        line("held-out error ≤ 1.1 × noise floor after adding", found, found["after"] <= 1.1 * found["floor"], "")
    covered = [hit for r in results for hit in r.get("covered", {}).values()]
    if covered:
        table.add_row(
            "95 % intervals that cover the truth", str(len(covered)), f"{100 * np.mean(covered):.1f}", "90–98"
        )
    spoken = [r for r in results if "screens" in r]
    for screen in AFFIRMED if spoken else ():
        wrong = np.mean([contradicted(r, screen) for r in spoken])
        said = np.mean([r["screens"].get(screen) is not None for r in spoken])
        what = f"false statements, {screen} (speaks on {100 * said:.0f} %)"
        table.add_row(what, str(len(spoken)), f"{100 * wrong:.1f}", "≤ 2")
    table.add_row("failed", str(len(frame)), f"{100 * (frame['verdict'] == 'failed').mean():.1f}", "0")
    console.print(table)
    if "seconds" in frame:
        console.print(
            f"time: median {frame['seconds'].median():.1f} s, longest {frame['seconds'].max():.1f} s per data set"
        )
    wrong = frame[(frame["kind"].isin(["one", "pair"])) & (frame["size"] >= 8) & ~frame["right"]]
    for _, r in wrong.iterrows():
        console.print(
            f"  missed: {'+'.join(r['hidden'])} at {r['size']} σ → {r['verdict']} {r['classes']}", markup=False
        )
    _recovery(one, out)
    _confusion(one[one["size"] >= 8], out)
    console.print(f"files: {out}", soft_wrap=True)


def _recovery(one: pd.DataFrame, out: Path) -> None:
    rates = one.groupby("size")["right"].agg(["mean", "size"]).rename(columns={"size": "sets"}).reset_index()
    if not len(rates):
        return
    figure = new_figure(6.0, 3.8)
    axes = figure.add_axes((0.12, 0.16, 0.84, 0.72))
    error = np.sqrt(rates["mean"] * (1 - rates["mean"]) / rates["sets"])
    axes.errorbar(rates["size"], 100 * rates["mean"], 100 * error, fmt="o-", color=COLORS[0], capsize=3)
    axes.axhline(95, color="0.5", linestyle="--", linewidth=1)
    axes.set_ylim(0, 104)
    finish(axes, "size of the hidden effect after refitting [σ]", "right effect or class of ≤ 3 [%]")
    figure.suptitle("Recovery of one hidden effect — simulated data", fontsize=11)
    save(figure, rates, out / "recovery.png")


def _confusion(one: pd.DataFrame, out: Path) -> None:
    if not len(one):
        return
    hidden = sorted({r[0] for r in one["hidden"]})
    columns = [*hidden, "adequate", "unexplained"]
    counts = pd.DataFrame(0.0, index=hidden, columns=columns)
    for _, r in one.iterrows():
        names = [group[0] for group in r["classes"]] if r["verdict"] in ("named", "class") else [r["verdict"]]
        for name in names:
            if name in counts.columns:
                counts.loc[r["hidden"][0], name] += 1 / len(names)
    shares = counts.div(counts.sum(1), axis=0)
    figure = new_figure(9.0, 7.6)
    axes = figure.add_axes((0.21, 0.24, 0.72, 0.69))
    image = axes.imshow(100 * shares, cmap="viridis_r", vmin=0, vmax=100, aspect="auto")
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(hidden)), hidden, fontsize=8)
    axes.set_xlabel("first named")
    axes.set_ylabel("hidden (8 σ and more)")
    figure.colorbar(image, ax=axes, label="share of data sets [%]")
    figure.suptitle("What was hidden and what was named — simulated data", fontsize=11)
    save(figure, shares.reset_index(names="hidden"), out / "confusion.png")
