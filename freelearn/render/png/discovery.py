"""The pictures of a discovery, as files and in TensorBoard."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from torch.utils.tensorboard import SummaryWriter

from freelearn.inference.score import EffectScore
from freelearn.inference.thresholds import ALPHA
from freelearn.render.png.canvas import COLORS, finish, heading, new_figure, save, to_rgb
from freelearn.render.png.curves import curve_numbers, curves
from freelearn.render.png.residual_map import residual_map, residual_table
from freelearn.results.discovery import Discovery, trail_numbers
from freelearn.results.states import state_title


def draw_discovery(discovery: Discovery, folder: Path, simulated: bool) -> list[Path]:
    """Writes staircase, ranking, likeness, residuals_before, residuals_after and curves_* (.png, with a .csv each)."""
    findings = discovery.findings
    figures: dict[str, tuple[Figure, pd.DataFrame]] = {"staircase": staircase(discovery, simulated)}
    if any(c["status"] == "tested" for c in findings.steps[0].candidates):
        figures["ranking"] = ranking(discovery, simulated)
    if len([s for s in findings.steps[0].scores if s.signature is not None]) > 1:
        figures["likeness"] = likeness(findings.steps[0].scores, simulated)
    for when, step in (("before", findings.steps[0]), ("after", findings.final)):
        table = discovery.predictions[when]
        effects = " + ".join(step.effects) or "no effect"
        title = f"{when}: {step.fit.model.name}, {effects}"
        figures[f"residuals_{when}"] = residual_map(table, title, simulated), residual_table(table)
    for number, (measured, named) in enumerate(discovery.curves, 1):
        title = f"{findings.final.fit.model.name}: {state_title(measured)}"
        figures[f"curves_{number}"] = curves(measured, named, title, simulated), curve_numbers(measured, named)
    paths = []
    with SummaryWriter(str(folder)) as writer:
        for number, step in enumerate(findings.steps):
            writer.add_scalar("error/fitted", step.E_train, number)
            writer.add_scalar("error/held_out", step.E_heldout, number)
            writer.add_scalar("error/noise_floor", step.floor, number)
            for name, value in step.fit.values().items():
                writer.add_scalar(f"parameter/{name}", value, number)
        for name, (figure, table) in figures.items():
            paths.append(folder / f"{name}.png")
            save(figure, table, paths[-1])
            writer.add_image(name, to_rgb(figure), dataformats="HWC")
    return paths


def staircase(discovery: Discovery, simulated: bool) -> tuple[Figure, pd.DataFrame]:
    """Held-out error from step to step, down towards the noise floor."""
    table = trail_numbers(discovery.content)
    labels = table["step"].str.replace(" + ", "\n+ ", regex=False)
    figure = new_figure(max(5.5, 2.2 + 1.5 * len(table)), 4.2)
    figure.suptitle(heading("Error on held-out kinematic states", simulated), fontsize=11)
    axes = figure.add_axes((0.13, 0.2, 0.84, 0.68))
    place = np.arange(len(table))
    percent = 100 * table["E_heldout"]
    axes.plot(place, percent, "o-", color=COLORS[0], ms=8, lw=1.6, label="held-out error")
    for x, value in zip(place, percent, strict=True):
        axes.annotate(f"{value:.3g} %", (x, value), xytext=(0, 9), textcoords="offset points", ha="center", fontsize=9)
    axes.hlines(
        100 * table["noise_floor"], place - 0.45, place + 0.45, color="black", linestyle="--", label="noise floor"
    )
    axes.set_xticks(place, labels, fontsize=9)
    finish(axes, "", "E [%], logarithmic")
    axes.set_xlim(-0.6, len(table) - 0.4)
    # The error may fall a hundredfold: on a linear axis the last steps, which decide, would not show.
    axes.set_yscale("log")
    low, high = float(min(percent.min(), 100 * table["noise_floor"].min())), float(percent.max())
    axes.set_ylim(low / 1.4, high * 1.6)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.legend(frameon=False, fontsize=9)
    return figure, table


def ranking(discovery: Discovery, simulated: bool) -> tuple[Figure, pd.DataFrame]:
    """How much each effect promised before any was added, and after the last one: size in σ after refitting."""
    steps = discovery.findings.steps
    frames = []
    for when, step in {"before": steps[0], "after": steps[-1]}.items():
        rows = [c for c in step.candidates if c["status"] == "tested"]
        frames.append(pd.DataFrame(rows).assign(when=when))
    table = pd.concat(frames, ignore_index=True)
    table["size"] = table["score"].clip(lower=0) ** 0.5
    before = table[table["when"] == "before"].sort_values("size")
    names = before["effect"].tolist()
    figure = new_figure(8.0, 1.8 + 0.27 * len(names))
    height = figure.get_size_inches()[1]
    figure.suptitle(heading("What each effect would explain", simulated), fontsize=11)
    axes = figure.add_axes((0.25, 0.85 / height, 0.7, 1 - 1.4 / height))
    place = np.arange(len(names))
    certain = (before["p_value"] <= ALPHA).to_numpy()
    size = before["size"].clip(lower=0.05).to_numpy()
    axes.barh(place[certain], size[certain], color=COLORS[0], height=0.62, label=f"before, p ≤ {ALPHA:g}")
    axes.barh(
        place[~certain], size[~certain], color="white", edgecolor=COLORS[0], height=0.62, label="before, may be chance"
    )
    if len(steps) > 1:
        after = table[table["when"] == "after"].set_index("effect")["size"].reindex(names).clip(lower=0.05)
        axes.plot(after, place, "D", color=COLORS[1], ms=5, label="after the last effect was added")
    axes.set_yticks(place, names, fontsize=9)
    axes.set_xscale("log")
    finish(axes, "size of the effect after refitting [σ], logarithmic", "")
    figure.legend(*axes.get_legend_handles_labels(), frameon=False, fontsize=8.5, loc="lower center", ncols=3)
    return figure, table


def likeness(scores: Sequence[EffectScore], simulated: bool) -> tuple[Figure, pd.DataFrame]:
    """How alike the effects' traces are in these data: largest cosine between them after refitting, 1 for twins."""
    shown = [s for s in scores if s.signature is not None]
    spans = [torch.linalg.qr(s.signature).Q for s in shown if s.signature is not None]
    cosine = np.array([[float(torch.linalg.matrix_norm(a.T @ b, 2)) for b in spans] for a in spans]).clip(0, 1)
    names = [s.effect for s in shown]
    table = pd.DataFrame(cosine, columns=names).assign(effect=names).set_index("effect").reset_index()
    side = 2.6 + 0.3 * len(names)
    figure = new_figure(side + 0.8, side)
    axes = figure.add_axes((2.0 / (side + 0.8), 1.75 / side, 0.3 * len(names) / (side + 0.8), 0.3 * len(names) / side))
    image = axes.imshow(cosine, cmap="viridis_r", vmin=0, vmax=1)
    for i, j in zip(*np.nonzero(cosine > 0.95), strict=True):
        if i != j:
            axes.text(j, i, "=", ha="center", va="center", color="white", fontsize=9, weight="bold")
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.tick_params(length=0)
    figure.suptitle(heading("Effects that look alike on these data", simulated), fontsize=10.5)
    bar = figure.colorbar(image, ax=axes, fraction=0.046, pad=0.03)
    bar.set_label("cosine after refitting (= above 0.95)", fontsize=8)
    return figure, table
