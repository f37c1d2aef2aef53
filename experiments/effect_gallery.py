"""What each effect does to the loads, as one picture and one table each in outputs/effects, and the pictures of the
library's effects, smaller, in docs/effects.

`python experiments/effect_gallery.py` draws all effects, with names after it only those. A picture is the difference
that the effect makes at its `scale` values over length and twist, for sample 4's design at half the protocol's
pressure, and what the effect needs besides: pressure rising, a state held for a minute after a last move of 1 mm and
10° to it, one third of a day gone since the first row, and the harshest state of the plane already visited. Of an
effect of the history it is a recording, quick steps of the pressure and of the length, then slow ramps of the
pressure, beside the model without it.
"""

from __future__ import annotations

import argparse
import json
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from rich.console import Console

from freelearn.common.files import write_whole
from freelearn.common.formats import MINUS, number, signed
from freelearn.data.accuracy import PAPER
from freelearn.data.beds import ELONGATION, FORCE, MOMENT, NMM, TWIST, Quantity
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.prediction import Status
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import DESIGNS
from freelearn.report.plots.canvas import heading, new_figure, ranges, save
from freelearn.testing.effect_page import beds_of, in_library

ROOT = Path(__file__).resolve().parents[1]
FOLDER, PAGE = ROOT / "outputs/effects", ROOT / "docs/effects"
# Dots per inch of the pictures in the page.
SMALL = 90
COLUMNS = {"force": "force_change_n", "moment": "moment_change_nmm"}
# What the bed's measuring shows [N, N·mm].
NOISE = {"force": PAPER.force / FORCE.factor, "moment": PAPER.moment / MOMENT.factor}
SAMPLE, PRESSURE_KPA, POINTS = 4, 36.25, 49
# The virtual bed's own material [Pa].
MATERIAL = {"C1": 1e6, "C2": 4e7}
HELD, CLOCK = 60.0, 3e4
# The protocol's steps: 1 mm and 10°.
MOVED = 1e-3, np.deg2rad(10.0)
# The recording: corners of its pressure [s, kPa] and of its elongation [s, mm], rows a second, and its twist [°].
CORNERS = (
    (0.0, 0.0),
    (0.5, 0.0),
    (0.6, 60.0),
    (3.5, 60.0),
    (3.6, 10.0),
    (6.0, 10.0),
    (10.0, 70.0),
    (14.0, 5.0),
    (16.0, 40.0),
)
STRETCHED = ((1.8, 0.0), (1.9, 1.0), (4.8, 1.0), (4.9, 0.0))
RATE, HELD_TWIST = 50.0, 40.0


# The effect that acts until the pressure changes.
STILL = "motion_friction"


def plane() -> pd.DataFrame:
    """The kinematic plane of the protocol, one row per point."""
    elongation, twist = np.meshgrid(np.linspace(-5, 5, POINTS), np.linspace(-120, 120, POINTS), indexing="ij")
    columns = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    table = pd.DataFrame({"elongation_mm": elongation.ravel(), "twist_deg": twist.ravel()})
    design = dict(zip(columns, DESIGNS[SAMPLE - 1], strict=True))
    return table.assign(sample=SAMPLE, step=0, pressure_kpa=PRESSURE_KPA, **design)


def states_of(table: pd.DataFrame, name: str) -> States:
    """The plane's states, all with the same past. name: of the effect, whose past may be another."""
    states = States.from_table(table)

    def all_rows(value: float) -> torch.Tensor:
        return torch.full_like(states.length, value)

    worst = all_rows(float(states.severity.max()))
    past = {"dwell": HELD, "clock": CLOCK, "moved_length": MOVED[0], "moved_twist": MOVED[1]}
    past["direction"] = 0.0 if name == STILL else 1.0
    return states.replace(past_severity=worst, **{name: all_rows(value) for name, value in past.items()})


def recording() -> pd.DataFrame:
    """A log of one recording."""
    time = np.arange(0.0, CORNERS[-1][0], 1 / RATE)
    columns = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    design = dict(zip(columns, DESIGNS[SAMPLE - 1], strict=True))
    table = pd.DataFrame({"time_s": time, "pressure_kpa": np.interp(time, *np.array(CORNERS).T)})
    return table.assign(
        sample=SAMPLE, run=1, step=np.arange(len(time)), elongation_mm=np.interp(time, *np.array(STRETCHED).T),
        twist_deg=HELD_TWIST, **design,
    )  # fmt: skip


def differences(name: str) -> pd.DataFrame:
    """elongation_mm, twist_deg, force_change_n, moment_change_nmm; NaN where there is no equilibrium. Along a recording
    time_s, pressure_kpa, force_n, moment_nmm (without the effect) and the same changes."""
    along = EFFECTS[name].port == "history"
    table = recording() if along else plane()
    states = States.from_table(table) if along else states_of(table, name)
    values = {f"{name}.{p.name}": p.scale for p in EFFECTS[name].declared_parameters()}
    with torch.no_grad():
        before = build_model("continuum", MATERIAL)(states)
        after = build_model("continuum", MATERIAL | values, [name])(states)
    change = after.loads - before.loads
    change[(before.status != Status.OK) | (after.status != Status.OK)] = torch.nan
    shown = table[["elongation_mm", "twist_deg"]]
    if along:
        plain = before.loads.numpy() / (FORCE.factor, MOMENT.factor)
        shown = table[["time_s", "pressure_kpa"]].assign(force_n=plain[:, 0], moment_nmm=plain[:, 1])
    return shown.assign(force_change_n=change[:, 0].numpy(), moment_change_nmm=change[:, 1].numpy() / NMM)


def picture(effect: Effect, table: pd.DataFrame) -> Figure:
    """Two panels over length × twist, red where the effect adds to the load and blue where it takes off; of the
    history, over the time and over the pressure."""
    figure = new_figure(7.8, 3.4)
    parameters = effect.declared_parameters()
    sizes = ", ".join(f"{p.symbol} = {p.scale:g} {'' if p.unit == '1' else p.unit}".strip() for p in parameters)
    where = f"{HELD_TWIST:g}°" if effect.port == "history" else f"{PRESSURE_KPA:g} kPa"
    title = f"{effect.name} ({effect.port}): {sizes}; sample {SAMPLE}, {where}".replace("-", MINUS)
    figure.suptitle(heading(title, True), fontsize=9.5)
    if effect.port == "history":
        along_time(figure, table)
        return figure
    for place, load in enumerate((FORCE, MOMENT), 1):
        axes = figure.add_subplot(1, 2, place)
        panel(axes, table, load)
        axes.set_xlabel(ELONGATION.label, fontsize=8.5)
        axes.set_ylabel(TWIST.label, fontsize=8.5)
        axes.tick_params(labelsize=8)
        axes.set_title(f"change of {load.label}", fontsize=9)
    figure.tight_layout(w_pad=1.5)
    return figure


def along_time(figure: Figure, table: pd.DataFrame) -> None:
    """The force with the effect and without it over the time, what the effect changes, and loops over the pressure."""
    pairs = ((table["force_n"], "0.6", "without"), (table["force_n"] + table["force_change_n"], "C3", "with"))
    change = ((table["force_change_n"], "C3", ""),)
    panels = (
        ("time_s", "time [s]", pairs, FORCE.label),
        ("time_s", "time [s]", change, f"change of {FORCE.label}"),
        ("pressure_kpa", "pressure P [kPa]", pairs, FORCE.label),
    )
    for place, (name, label, lines, shown) in enumerate(panels, 1):
        axes = figure.add_subplot(1, 3, place)
        for values, color, text in lines:
            axes.plot(table[name], values, color=color, lw=1.1, label=text)
        axes.set_xlabel(label, fontsize=8)
        axes.set_ylabel(shown, fontsize=8)
        axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, frameon=False)
    figure.tight_layout(w_pad=1.0)


def panel(axes: Axes, table: pd.DataFrame, load: Quantity) -> None:
    """One load's change: bands between lines of equal change, the middle one about zero."""
    x, y, z = (table[c].to_numpy().reshape(POINTS, POINTS) for c in ("elongation_mm", "twist_deg", COLUMNS[load.name]))
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    largest, noise = max(-low, high), NOISE[load.name]
    same = high - low < 1e-6 * largest
    # Rounding is to give no pattern where the edge of a band is hit.
    z = np.full_like(z, np.nanmean(z)) if same else z
    # What changes nothing is scaled to what the measuring shows, and what changes all alike is no darkest corner.
    limit = noise if largest < 1e-6 * noise else 2 * largest if same else largest
    levels = band_edges(limit)
    colors = axes.contourf(
        x, y, np.clip(z, levels[0], levels[-1]), levels, cmap="RdBu_r", vmin=levels[0], vmax=levels[-1]
    )
    if largest < 1e-6 * noise:
        axes.text(0.5, 0.5, "unchanged", transform=axes.transAxes, ha="center", va="center", fontsize=9)
    elif same:
        text = f"{signed(float(np.nanmean(z)))}{load.suffix} everywhere"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=9)
    else:
        lines = axes.contour(x, y, z, levels=levels[1:-1], colors="black", linewidths=0.5)
        for text in axes.clabel(lines, fontsize=7, fmt=lambda value: number(value, 3)):
            text.set_bbox({"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5})
    bar = axes.figure.colorbar(colors, ax=axes, ticks=levels[1:-1])
    bar.ax.set_yticklabels([number(level, 3) for level in levels[1:-1]], fontsize=7.5)


def band_edges(limit: float) -> np.ndarray:
    """Where the bands of a symmetric scale meet: …, −3u, −u, u, 3u, …, with a round u. No line is at zero: where a
    change is zero but for rounding, that would be specks.

    >>> band_edges(6.0).tolist()
    [-7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0]
    """
    unit = 10.0 ** np.floor(np.log10(limit / 4))
    unit *= next(factor for factor in (1, 2, 3, 5, 10) if limit <= 9 * factor * unit)
    count = int(np.ceil((limit / unit + 1) / 2))
    edges: np.ndarray = unit * (2 * np.arange(-count, count) + 1)
    return edges


def small(figure: Figure, table: pd.DataFrame, path: Path) -> None:
    """The same picture for the page, in a palette: some ten kilobytes."""
    memory = BytesIO()
    figure.savefig(memory, format="png", dpi=SMALL)
    about = PngInfo()
    about.add_text("Description", json.dumps(ranges(table[list(COLUMNS.values())])))
    colors = Image.open(memory).convert("RGB").quantize(64)
    write_whole(path, lambda beside: colors.save(beside, format="png", optimize=True, pnginfo=about))


def main(names: list[str]) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    console = Console()
    for folder in (FOLDER, PAGE):
        folder.mkdir(parents=True, exist_ok=True)
    for effect in make_effects(names or list(EFFECTS), "continuum"):
        table = differences(effect.name)
        figure = picture(effect, table)
        save(figure, table, FOLDER / f"{effect.name}.png")
        if in_library(effect):
            small(figure, table, PAGE / f"{effect.name}.png")
        parameters = ", ".join(f"{p.name} ({p.unit})" for p in effect.declared_parameters())
        told = f"beds: {beds_of(type(effect))}"
        console.print(f"[bold]{effect.name}[/]  {effect.port}  {parameters}  {told}  {effect.suspect}", soft_wrap=True)
    console.print(f"Pictures and tables are in {FOLDER}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python experiments/effect_gallery.py", description=__doc__)
    parser.add_argument("names", nargs="*", help="effects of the library; all by default")
    main(parser.parse_args().names)
