"""What each effect does to the loads, as one picture and one table each in outputs/effects.

`python experiments/effect_gallery.py` draws all effects, with names after it only those. A picture is the difference
that the effect makes at its `scale` values over length and twist, for sample 4's design at half the protocol's
pressure, and what the effect needs besides: pressure rising, a state held for a minute, one third of a day gone since
the first row, and the harshest state of the plane already visited.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure
from rich.console import Console

from freelearn.bed.virtual import DESIGNS
from freelearn.measurements.states import States
from freelearn.models.build import build_model
from freelearn.models.effect import Effect
from freelearn.models.effects.registry import EFFECTS, make_effects
from freelearn.models.prediction import Status
from freelearn.render.png.canvas import heading, new_figure, save
from freelearn.testing.effect_page import beds_of
from freelearn.units import NMM

FOLDER = Path(__file__).resolve().parents[1] / "outputs/effects"
SAMPLE, PRESSURE_KPA, POINTS = 4, 36.25, 49
# The virtual bed's own material [Pa].
MATERIAL = {"C1": 1e6, "C2": 4e7}
HELD, CLOCK = 60.0, 3e4


def plane() -> pd.DataFrame:
    """The kinematic plane of the protocol, one row per point."""
    elongation, twist = np.meshgrid(np.linspace(-5, 5, POINTS), np.linspace(-120, 120, POINTS), indexing="ij")
    columns = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    table = pd.DataFrame({"elongation_mm": elongation.ravel(), "twist_deg": twist.ravel()})
    design = dict(zip(columns, DESIGNS[SAMPLE - 1], strict=True))
    return table.assign(sample=SAMPLE, step=0, pressure_kpa=PRESSURE_KPA, **design)


def states_of(table: pd.DataFrame) -> States:
    """The plane's states, all with the same past."""
    states = States.from_table(table)

    def all_rows(value: float) -> torch.Tensor:
        return torch.full_like(states.length, value)

    worst = all_rows(float(states.severity.max()))
    return states.replace(direction=all_rows(1.0), dwell=all_rows(HELD), clock=all_rows(CLOCK), past_severity=worst)


def differences(name: str) -> pd.DataFrame:
    """elongation_mm, twist_deg, force_change_n, moment_change_nmm; NaN where there is no equilibrium."""
    table = plane()
    states = states_of(table)
    values = {f"{name}.{p.name}": p.scale for p in EFFECTS[name].declared_parameters()}
    with torch.no_grad():
        before = build_model("continuum", MATERIAL)(states)
        after = build_model("continuum", MATERIAL | values, [name])(states)
    change = after.loads - before.loads
    change[(before.status != Status.OK) | (after.status != Status.OK)] = torch.nan
    shown = table[["elongation_mm", "twist_deg"]]
    return shown.assign(force_change_n=change[:, 0].numpy(), moment_change_nmm=change[:, 1].numpy() / NMM)


def picture(effect: Effect, table: pd.DataFrame) -> Figure:
    """Two panels over length × twist, red where the effect adds to the load and blue where it takes off."""
    figure = new_figure(10.0, 4.2)
    parameters = effect.declared_parameters()
    sizes = ", ".join(f"{p.symbol} = {p.scale:g} {'' if p.unit == '1' else p.unit}".strip() for p in parameters)
    figure.suptitle(heading(f"{effect.name} ({effect.port}): {sizes}; sample {SAMPLE}, {PRESSURE_KPA:g} kPa", True))
    figure.text(0.995, 0.005, f"can be told on the beds: {beds_of(type(effect))}", ha="right", va="bottom", fontsize=7)
    x, y = (table[c].to_numpy().reshape(POINTS, POINTS) for c in ("elongation_mm", "twist_deg"))
    for number, (column, title) in enumerate(
        (("force_change_n", "change of force F [N]"), ("moment_change_nmm", "change of moment M [N·mm]")), 1
    ):
        axes = figure.add_subplot(1, 2, number)
        z = table[column].to_numpy().reshape(POINTS, POINTS)
        # What is zero but for rounding should look like it.
        limit = max(float(np.nanmax(np.abs(z))), 1e-6)
        mesh = axes.pcolormesh(x, y, z, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="gouraud")
        if limit > 1e-6 and np.nanmax(z) - np.nanmin(z) > 1e-6 * limit:
            lines = axes.contour(x, y, z, levels=8, colors="black", linewidths=0.5)
            axes.clabel(lines, fontsize=7, fmt="%.3g")
        axes.set_xlabel("elongation [mm]")
        axes.set_ylabel("twist [deg]")
        axes.set_title(title, fontsize=10)
        figure.colorbar(mesh, ax=axes)
    figure.tight_layout()
    return figure


def main(names: list[str]) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    console = Console()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for effect in make_effects(names or list(EFFECTS), "continuum"):
        table = differences(effect.name)
        save(picture(effect, table), table, FOLDER / f"{effect.name}.png")
        parameters = ", ".join(f"{p.name} ({p.unit})" for p in effect.declared_parameters())
        told = f"beds: {beds_of(type(effect))}"
        console.print(f"[bold]{effect.name}[/]  {effect.port}  {parameters}  {told}  {effect.suspect}", soft_wrap=True)
    console.print(f"Pictures and tables are in {FOLDER}")


if __name__ == "__main__":
    main(sys.argv[1:])
