"""A real muscle and a real end block commanded: pressures that the model asks for, beside those that were measured."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from coverage import asked_of, fitted, taken_in
from matplotlib.figure import Figure
from rich.table import Table

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.loaded_table import load_table
from freelearn.data.beds import KPA
from freelearn.data.rows import Rows
from freelearn.queries.inverse.asker import Asker
from freelearn.report.plots.canvas import new_figure, save

TENTHS = 10


@dataclass(frozen=True)
class Commanded:
    """name: of the panel. measured, asked, half: pressures and half their bands, (n,) kPa, of each row that was left
    out; fine (n,) bool: rows with an answer."""

    name: str
    measured: np.ndarray
    asked: np.ndarray
    half: np.ndarray
    fine: np.ndarray


def muscle() -> Commanded:
    """The muscle's pressure for its length and force, each length by a fit without it; slack rows ask nothing."""
    table = load_table(settings(TrainSettings, ["data=dmsp20", "train=all"]).data).table
    effects = ("fiber_misalignment", "small_strain_stiffness", "end_taper")
    part = table["elongation_mm"].round(1).to_numpy()
    taut = (table["slack"] == 0).to_numpy()
    return _commanded("DMSP-20-300: pressure for a length and a force", table, effects, 0, part, taut, [2], True)


def end_block(data: Path) -> Commanded:
    """Pressures 2 and 3 of three actuators for a pose of the free end, pressure 1 given; random tenths left out."""
    table = taken_in("parallel_free_end", data, Path(tempfile.mkdtemp()))
    part = np.random.default_rng(0).integers(0, TENTHS, len(table))
    effects = ("off_axis", "small_strain_stiffness")
    every = np.ones(len(table), dtype=bool)
    return _commanded("free end block: pressures 2 and 3 for a pose", table, effects, 3, part, every, [3, 4], False)


def _commanded(
    name: str, table, effects: Sequence[str], members: int, part: np.ndarray, asked: np.ndarray, blank: list[int],
    by_states: bool,
) -> Commanded:  # fmt: skip
    rows, found = Rows.from_table(table), []
    for number in np.unique(part):
        out = torch.as_tensor(part == number)
        model, bands, train = fitted(rows[~out], effects, (), members, None, by_states)
        fresh = rows[out & torch.tensor(asked)]
        if not len(fresh):
            continue
        system, x, y = asked_of(model, fresh)
        question = x.clone()
        question[:, blank] = torch.nan
        answered = Asker.from_model(model, train, bands.miss).answered(system, question, y)
        fine = np.array([status == "ok" for status in answered.status])
        for i in blank:
            values = (x[:, i], answered.x[:, i], answered.x_half[:, i])
            found.append(np.c_[torch.stack(values, dim=-1).numpy() / KPA, fine])
    measured, command, half, fine = np.concatenate(found).T
    return Commanded(name, measured, command, half, fine.astype(bool))


def commanded_table(parts: Sequence[Commanded]) -> Table:
    """One line each."""
    heads = ("rows left out", "answered", "root mean square error [kPa]", "within the 95 % band", "half width [kPa]")
    shown = Table("commanded", *heads, title="Pressures commanded, beside those measured")
    for part in parts:
        error = (part.asked - part.measured)[part.fine]
        inside = np.abs(error) <= part.half[part.fine]
        size = f"{np.sqrt((error**2).mean()):.1f}"
        counts = str(len(part.fine)), str(int(part.fine.sum()))
        shown.add_row(
            part.name, *counts, size, f"{100 * inside.mean():.0f} %", f"{np.median(part.half[part.fine]):.1f}"
        )
    return shown


def draw_commanded(parts: Sequence[Commanded], path: Path) -> None:
    """The picture, with its numbers beside it."""
    columns = ("measured_kpa", "commanded_kpa", "half_band_kpa", "answered")
    numbers = [
        pd.DataFrame(dict(zip(columns, (p.measured, p.asked, p.half, p.fine), strict=True))).assign(what=p.name)
        for p in parts
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    save(commanded_picture(parts), pd.concat(numbers, ignore_index=True), path)


def commanded_picture(parts: Sequence[Commanded]) -> Figure:
    """A panel each: commanded over measured, with the bands."""
    figure = new_figure(5.2 * len(parts), 4.6)
    figure.set_layout_engine("constrained")
    for axes, part in zip(np.atleast_1d(figure.subplots(1, len(parts))), parts, strict=True):
        fine = part.fine
        axes.errorbar(
            part.measured[fine], part.asked[fine], yerr=part.half[fine], fmt="o", ms=3, lw=0.8, color="#0072b2",
            ecolor="#9ec9e2", label="commanded, 95 % band",
        )  # fmt: skip
        ends = [min(part.measured.min(), 0.0), 1.05 * part.measured.max()]
        axes.plot(ends, ends, color="black", lw=1, label="as measured")
        axes.set(xlabel="measured pressure [kPa]", ylabel="commanded pressure [kPa]", title=part.name)
        axes.title.set_fontsize(10)
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, loc="upper left")
    return figure
