"""What the terminal shows of a rubber's fit, and of all combinations of effects."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd

from freelearn.fitting.rubber import RubberFit
from freelearn.measurements.specimen_modes import MODES
from freelearn.results.formats import number, percent
from freelearn.results.tables import DisplayTable


def mode_table(fits: Mapping[str, RubberFit]) -> DisplayTable:
    """Errors by mode of fits to the same rows, by their names; modes that none was fitted to are marked."""
    first = next(iter(fits.values()))
    rows = [
        [
            mode if about.fitted else f"{mode} (held out)",
            str(about.n),
            *(percent(fit.modes[mode].error) for fit in fits.values()),
        ]
        for mode, about in first.modes.items()
    ]
    return DisplayTable.of(["mode"], ["stresses", *fits], rows, title="error E in % of a mode's largest stress")


def rubber_parameters(fit: RubberFit) -> DisplayTable:
    """Values and standard errors, which take the misfits of neighbors as independent, without intervals."""
    rows = [
        [name, number(value, 6), number(fit.stderr[name], 2), fit.rubber.declared[name].unit]
        for name, value in fit.values.items()
    ]
    return DisplayTable.of(["parameter"], ["value", "± stderr"], rows, last=["unit"])


def rubber_notes(fit: RubberFit, alone: RubberFit) -> list[str]:
    """What to know before trusting the fit. alone: the same rows fitted without effects."""
    notes = [f"{name} sits on its bound: the data do not ask for it, or for its opposite." for name in fit.at_bound]
    unknown = [n for n, error in fit.stderr.items() if not math.isfinite(error) and n not in fit.at_bound]
    notes += [f"{name} is not determined by these tests." for name in unknown]
    worse = [m for m, e in fit.modes.items() if not (e.fitted or e.error <= alone.modes[m].error)]
    notes += [f"Held-out {m} is predicted worse than without the effects: do not trust them there." for m in worse]
    return notes if fit.message.startswith("Converged") else [*notes, fit.message]


def combination_table(compared: pd.DataFrame) -> DisplayTable:
    """Errors in %: every mode with all fitted together, and each mode predicted from the others.

    compared: of inference.rubber.compare."""
    together = compared[compared["held_out"] == ""]
    apart = compared[compared["held_out"] == compared["mode"]]
    modes = [MODES[mode].short for mode in together["mode"].unique()]
    rows = []
    for effects in compared["effects"].unique():
        fitted, predicted = (part[part["effects"] == effects] for part in (together, apart))
        overall = float((fitted["error"] ** 2 * fitted["n"]).sum() / fitted["n"].sum()) ** 0.5
        errors = [*fitted["error"], overall, *predicted["error"]]
        rows.append([effects.replace(" ", " + "), *(percent(error, 1) for error in errors)])
    return DisplayTable.of(
        ["energy"],
        [*modes, "all", *(f"{mode}*" for mode in modes if len(apart))],
        rows,
        title="error E in %: root mean square over the mode's largest stress",
        caption="all modes fitted together; *: the mode held out and predicted from the others",
    )
