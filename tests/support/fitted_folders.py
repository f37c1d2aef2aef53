"""Folders of runs that need no fit: a model at parameters that are known, and the rows that it would have seen."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

import freelearn
from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.beds import NMM
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import predicted_table
from freelearn.physics.models.build import build_model, save_checkpoint
from freelearn.physics.simulated_bed import DESIGNS, protocol
from freelearn.queries.fitted_model import FittedModel

C1, C2 = 8e5, 2e7
PLACE, LOADS = ["elongation_mm", "twist_deg"], ["force_n", "moment_nmm"]


def continuum(effects: dict[str, dict[str, float]] | None = None, c1: float = C1, c2: float = C2) -> Model[Any]:
    """A continuum with effects at given strengths (SI)."""
    effects = effects or {}
    model = build_model("continuum", {"C1": c1, "C2": c2}, list(effects))
    model.set_values({f"{name}.{p}": value for name, own in effects.items() for p, value in own.items()})
    return model


def shown(model: Model[Any], table: pd.DataFrame) -> pd.DataFrame:
    """The table with the loads that a model shows at its rows, NaN where it has none."""
    with torch.no_grad():
        loads, status = model(States.from_table(table if "step" in table else table.assign(step=0)))
    loads = torch.where((status == 1)[:, None], torch.nan, loads).numpy()
    return table.assign(force_n=loads[:, 0], moment_nmm=loads[:, 1] / NMM)


def grid(sample: int = 3, elongations=(-4.0, 0.0, 4.0), twists=(-90.0, -30.0, 30.0, 90.0)) -> pd.DataFrame:
    """The simulated bed's protocol for one sample, at some of its places, without loads."""
    table = protocol()
    nearest_turn = [float(min(table["twist_deg"].unique(), key=lambda t: abs(t - w))) for w in twists]
    there = (table["sample"] == sample) & table["elongation_mm"].isin(elongations)
    return table[there & table["twist_deg"].isin(nearest_turn)].reset_index(drop=True)


def folder_of(
    folder: Path,
    model: Model[Any],
    table: pd.DataFrame,
    split: Any = "train",
    accuracy: Accuracy | None = PAPER,
    covariance: np.ndarray | None = None,
) -> Path:
    """Writes what freelearn.load reads of a run: the rows, the model, what is known of its parameters."""
    folder.mkdir(parents=True, exist_ok=True)
    with torch.no_grad():
        prediction = model(States.from_table(table))
    predicted_table(table, split, prediction).to_csv(folder / "predictions.csv", index=False)
    save_checkpoint(model, folder / "checkpoint.ckpt")
    known = None
    if covariance is not None:
        known = [[float(v) if np.isfinite(v) else None for v in row] for row in covariance]
    content = {"train": "all", "seed": 0, "covariance": known, "accuracy": asdict(accuracy) if accuracy else None}
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


def fitted(folder: Path, model: Model[Any], table: pd.DataFrame, **more: Any) -> FittedModel:
    """That run, taken up again."""
    return freelearn.load(folder_of(folder, model, table, **more))


def design(sample: int) -> dict[str, float]:
    """Columns of one of the paper's actuators."""
    names = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    return {"sample": sample, **dict(zip(names, DESIGNS[sample - 1], strict=True))}
