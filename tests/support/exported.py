"""Fitted actuators to export, of every model and bed, without a fit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import beds
import numpy as np
import pandas as pd
from fitted_folders import C1, C2, continuum, folder_of, grid, shown

import freelearn
from freelearn.data.beds import BED
from freelearn.data.columns import members_in, with_members
from freelearn.export import export
from freelearn.export.actuator_functions import Functions
from freelearn.physics.models.build import build_model

# Known to a hundredth each.
SHARE = 0.01
MODELS = ("linear", "continuum", "mlp", "hybrid")
BEDS = ("kinematic", "isometric", "dead_load", "inflation", "block")
EFFECTS = {
    "continuum": {"end_clamps.clamp_length": 2e-3, "friction_hysteresis.force": 0.1, "stress_softening.depth": 0.1},
    "linear": {"force_offset.offset": 0.2},
}
VALUES = {"linear": {"ka": 3e4, "kb": 0.5, "kc": 20.0}, "continuum": {"C1": C1, "C2": C2}}


def actuator(folder: Path, effects: dict[str, dict[str, float]] | None = None, known: bool = True, **more):
    """A continuum with effects, as a run that was fitted to the simulated bed's third sample."""
    model = continuum(effects)
    table = shown(model, grid())
    return freelearn.load(folder_of(folder, model, table, covariance=_known(model) if known else None, **more))


def linear(folder: Path):
    """The model that is the quickest of all to trace, as a run."""
    model = build_model("linear", VALUES["linear"], [])
    return freelearn.load(folder_of(folder, model, shown(model, grid()), covariance=np.diag([1.0, 1e-8, 1e-4])))


@contextmanager
def already(functions: Functions) -> Iterator[None]:
    """Inside, exports begin with functions that were traced before: that takes the most time of all."""
    with patch.object(export, "Functions", lambda actuator: functions):
        yield


def table_of(bed: str) -> pd.DataFrame:
    """A measurement table of a bed, as a program has it; of several samples the first."""
    if bed == "kinematic":
        return shown(continuum(), grid())
    if bed == "block":
        return with_members(beds.block({}), beds.MEMBERS)
    table = beds.TABLES[bed]({}).assign(**{BED: bed})
    return table[table["sample"] == 1].reset_index(drop=True)


def run_of(folder: Path, name: str, bed: str):
    """A model as a run that was fitted to a bed's table. Raises UserError where it cannot be."""
    if name in ("mlp", "hybrid"):
        # What it learns is no parameter that could be set.
        return _fitted(folder, name, bed)
    table, effects = table_of(bed), EFFECTS.get(name, {})
    members = len(members_in(table.columns))
    model = build_model(name, VALUES[name], list(dict.fromkeys(k.split(".")[0] for k in effects)), [1], members)
    model.set_values({n: effects[n.split("[")[0]] for n in model.declared if n.split("[")[0] in effects})
    return freelearn.load(folder_of(folder, model, table, covariance=_known(model)))


def _fitted(folder: Path, name: str, bed: str):
    folder.mkdir(parents=True)
    more = {} if bed in ("kinematic", "block") else {"bed": bed}
    if bed == "block":
        beds.MEMBERS.to_csv(folder / "members.csv", index=False)
        more["members"] = folder / "members.csv"
    table = beds.block({}) if bed == "block" else table_of(bed).drop(columns=BED, errors="ignore")
    # As many rows as a network has weights.
    if name == "mlp" and bed == "dead_load":
        table = beds.dead_load({}, levels=32).query("sample == 1")
    if name == "mlp" and bed == "inflation":
        table = pd.concat([beds.inflation({}, seed) for seed in (0, 1)], ignore_index=True)
    return freelearn.fit(table, model=name, **more)


def _known(model) -> np.ndarray:
    values = np.array(list(model.scalars().values()))
    return np.diag((SHARE * values) ** 2)


# An effect of the history each, so strong that nobody overlooks it.
HISTORY = {
    "maxwell_slip": {"share": 0.2, "force": 3.0, "moment": 0.02, "asymmetry": 0.2},
    "contact_slip": {"share": 0.2, "force": 0.01, "moment": 0.01},
    "creep": {"share": 0.2, "time": 1.0},
    "second_creep": {"share": 0.1, "time": 4.0},
    "third_creep": {"share": 0.1, "time": 20.0},
    "supply_lag": {"time": 0.2},
    "dead_time": {"delay": 0.25},
    "valve_flow": {"squared_resistance": 4e9, "critical": 0.3},
    "gas_warming": {"time": 0.1, "cooling": 1.0},
    "sensor_lag": {"force": 0.1, "moment": 0.2},
    "inertia": {"force": 0.3, "moment": 0.2, "damping": 0.2},
}


def sampled(seed: int = 0, runs: int = 2, samples: int = 60, every: float = 0.16) -> pd.DataFrame:
    """Recordings of the simulated bed's third sample, unevenly sampled, without loads: pressure, elongation and twist
    go on straight lines from place to place."""
    generator, found = np.random.default_rng(seed), []
    for run in range(1, runs + 1):
        time = np.cumsum(every * generator.uniform(0.6, 1.6, samples))

        def lines(low: float, high: float, length: int) -> np.ndarray:
            places = np.arange(0, samples + length, length)
            return np.interp(np.arange(samples), places, generator.uniform(low, high, len(places)))

        own = {"pressure_kpa": lines(0, 60, 8), "elongation_mm": lines(-4, 4, 20), "twist_deg": lines(-90, 90, 20)}
        table = pd.concat([grid().iloc[:1]] * samples, ignore_index=True)
        found.append(table.assign(time_s=time, run=run, **own))
    return pd.concat(found, ignore_index=True)


def log_run(folder, effects, values=None, name="linear", bed="kinematic", log=True, **more):
    """A model with effects of the history as a run that was fitted to recordings; values: of its parameters besides."""
    values = values or {}
    model = build_model(name, VALUES[name], [*dict.fromkeys([*effects, *(k.split(".")[0] for k in values)])])
    model.set_values({f"{e}.{n}": v for e in effects for n, v in HISTORY[e].items()} | values)
    table = sampled(**more)
    if bed == "dead_load":
        hung = {"force_n": 20 * table["elongation_mm"], "moment_nmm": 3 * table["twist_deg"], BED: bed}
        table = table.drop(columns=["elongation_mm", "twist_deg"]).assign(**hung, elongation_mm=0.0, twist_deg=0.0)
    else:
        table = shown(model, table)
    table = table if log else table.drop(columns=["time_s", "run"])
    return freelearn.load(folder_of(folder, model, table, covariance=_known(model)))
