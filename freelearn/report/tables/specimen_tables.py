"""A rubber's fit: stress against stretch as numbers, and what the terminal shows of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
import torch

from freelearn.common.display import DisplayTable
from freelearn.common.formats import number, percent
from freelearn.data.specimen_schema import MODES, SHEAR
from freelearn.data.specimen_tests import TIME, names_of, timed
from freelearn.fitting.rubber_fit import RubberFit, predicted
from freelearn.physics.mechanics.energy import MPA
from freelearn.physics.models.rubber import per_shear

# Nominal stress against stretch: measured, and what rubbers fitted alike say, as numbers.

POINTS = 200
# A modulus at rest whose interval spans more than this factor is not known.
WIDE = 10.0
COLUMNS = ["source", "mode", "specimen", "stretch", "stretch_2", "stress_mpa", "stress_2_mpa", "fitted"]


def curve_table(table: pd.DataFrame, fits: Mapping[str, RubberFit]) -> pd.DataFrame:
    """The rows measured (source "measured") and each fit's curves over its modes' stretches, or along its recordings
    (source: the fit's name).

    Columns: source, mode, specimen, stretch, stretch_2, stress_mpa, stress_2_mpa (blank where the mode did not measure
    it), fitted (whether the test was), time_s where there are recordings.
    """
    modes = next(iter(fits.values())).modes
    names = names_of(table)
    rows = [table.assign(source="measured", fitted=[modes[name].fitted for name in names])]
    for mode, error in modes.items():
        own = table[names == mode]
        if timed(own).any():
            rows += [predicted(fit, own).assign(source=name, fitted=error.fitted) for name, fit in fits.items()]
            continue
        path = _path(own, mode)
        for name, fit in fits.items():
            rows.append(_curve(fit, path, own).assign(source=name, mode=mode, fitted=error.fitted))
    return pd.concat(rows, ignore_index=True)[[*COLUMNS, *([TIME] if TIME in table else [])]]


def _path(rows: pd.DataFrame, mode: str) -> pd.DataFrame:
    """specimen, stretch, stretch_2 along a curve through a mode's rows, from rest where the mode tells the way."""
    if MODES[mode].power is not None:
        stretch = np.linspace(min(1.0, rows["stretch"].min()), max(1.0, rows["stretch"].max()), POINTS)
        return pd.DataFrame({"specimen": "", "stretch": stretch, "stretch_2": MODES[mode].across(stretch)})
    parts = []
    for specimen, own in rows.groupby("specimen", sort=False):
        place = np.linspace(0, len(own) - 1, POINTS)
        names = ("stretch", "stretch_2")
        way = {name: np.interp(place, np.arange(len(own)), own[name].to_numpy()) for name in names}
        parts.append(pd.DataFrame({"specimen": specimen, **way}))
    return pd.concat(parts, ignore_index=True)


def _curve(fit: RubberFit, path: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """A path with the nominal stresses of a fit [MPa] in the directions in which a mode's rows hold some."""
    values = {name: torch.tensor(value, dtype=torch.float64) for name, value in fit.values.items()}
    one, two = (torch.tensor(path[name].to_numpy()) for name in ("stretch", "stretch_2"))
    along = fit.rubber.stress(values, one, two).numpy() / MPA
    across = fit.rubber.stress(values, two, one).numpy() / MPA
    if (rows["mode"] == SHEAR).all():
        along = along * per_shear(one).numpy()
    shown = {"stress_mpa": along, "stress_2_mpa": across}
    return path.assign(**{n: stress if rows[n].notna().any() else np.nan for n, stress in shown.items()})


# What the terminal shows of a rubber's fit, and of all combinations of effects.


def mode_table(fits: Mapping[str, RubberFit], apart: Mapping[str, float] | None = None) -> DisplayTable:
    """Errors by test of fits to the same rows, by their names; tests that none was fitted to are marked. apart: error
    of each test when the last fit's others alone are fitted."""
    first = next(iter(fits.values()))
    rows = [
        [
            mode if about.fitted else f"{mode} (held out)",
            str(about.n),
            *(percent(fit.modes[mode].error) for fit in fits.values()),
            *([percent(apart.get(mode, math.nan))] if apart else []),
        ]
        for mode, about in first.modes.items()
    ]
    recorded = any(mode not in MODES for mode in first.modes)
    title = f"error E in % of a {'test' if recorded else 'mode'}'s largest stress"
    heads = ["stresses", *fits, *(["held out"] if apart else [])]
    return DisplayTable.from_rows(["test" if recorded else "mode"], heads, rows, title=title)


def rubber_parameters(fit: RubberFit) -> DisplayTable:
    """Values and standard errors; of recordings, whose misfits count by how alike neighbors are, 95 % intervals."""
    recorded = bool(fit.rubber.relaxation)
    rows = [
        [
            name,
            number(value, 6),
            number(fit.stderr[name], 2),
            *([f"{number(end, 3)}" for end in fit.intervals[name]] if recorded else []),
            fit.rubber.declared[name].unit,
        ]
        for name, value in fit.values.items()
    ]
    heads = ["value", "± stderr", *(["95 % from", "to"] if recorded else [])]
    return DisplayTable.from_rows(["parameter"], heads, rows, last=["unit"])


def rubber_notes(fit: RubberFit, alone: RubberFit) -> list[str]:
    """What to know before trusting the fit. alone: the same rows fitted without effects."""
    of_time = fit.rubber.relaxation.declared
    opposite = "the data do not ask for it, or for its opposite."
    notes = [
        f"{name} sits on its bound: {'these recordings do not tell it.' if name in of_time else opposite}"
        for name in fit.at_bound
    ]
    unknown = [n for n, error in fit.stderr.items() if not math.isfinite(error) and n not in fit.at_bound]
    notes += [f"{name} is not determined by these tests." for name in unknown]
    if fit.rubber.relaxation and fit.intervals["C1"][1] > WIDE * fit.intervals["C1"][0]:
        low, high = (number(end, 2) for end in fit.intervals["C1"])
        notes.append(
            f"C1, the rubber at rest, is anywhere from {low} to {high} Pa: hold longer, or come back, before a model "
            "takes it over."
        )
    worse = [m for m, e in fit.modes.items() if not (e.fitted or e.error <= alone.modes[m].error)]
    notes += [f"Held-out {m} is predicted worse than without the effects: do not trust them there." for m in worse]
    return notes if fit.message.startswith("Converged") else [*notes, fit.message]


def combination_table(compared: pd.DataFrame) -> DisplayTable:
    """Errors in %: every mode with all fitted together, and each mode predicted from the others.

    compared: of rubber_effects.compare."""
    together = compared[compared["held_out"] == ""]
    apart = compared[compared["held_out"] == compared["mode"]]
    modes = [MODES[mode].short for mode in together["mode"].unique()]
    rows = []
    for effects in compared["effects"].unique():
        fitted, predicted = (part[part["effects"] == effects] for part in (together, apart))
        overall = float((fitted["error"] ** 2 * fitted["n"]).sum() / fitted["n"].sum()) ** 0.5
        errors = [*fitted["error"], overall, *predicted["error"]]
        rows.append([effects.replace(" ", " + "), *(percent(error, 1) for error in errors)])
    return DisplayTable.from_rows(
        ["energy"],
        [*modes, "all", *(f"{mode}*" for mode in modes if len(apart))],
        rows,
        title="error E in %: root mean square over the mode's largest stress",
        caption="all modes fitted together; *: the mode held out and predicted from the others",
    )


def time_table(compared: pd.DataFrame, of: str) -> DisplayTable:
    """What recordings make of energies or relaxations. compared: of rubber_relaxation; of: its column of words."""
    rows = [
        [str(row[of]).replace(" ", " + ") if of == "effects" else str(row[of]), str(row["parameters"])]
        + [percent(row[name], 1) for name in ("error", "held_out")]
        for _, row in compared.iterrows()
    ]
    return DisplayTable.from_rows(
        ["energy at rest" if of == "effects" else of],
        ["parameters", "fitted", "held out"],
        rows,
        title="error E in %: root mean square over each test's largest stress",
        caption="held out: each test predicted from the others",
    )
