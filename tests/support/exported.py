"""Fitted actuators to export, of every model and bed, without a fit."""

from __future__ import annotations

from pathlib import Path

import beds
import numpy as np
import pandas as pd
from fitted_folders import C1, C2, continuum, folder_of, grid, shown

import freelearn
from freelearn.data.beds import BED
from freelearn.data.columns import members_in, with_members
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
