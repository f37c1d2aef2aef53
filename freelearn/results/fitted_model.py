"""A fitted model, taken up again from a run's folder: what `freelearn.load` gives."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.measurements.members import DESIGN
from freelearn.measurements.states import States
from freelearn.models.base import BLOCK, Model
from freelearn.models.build import load_model
from freelearn.models.own import load_own_code
from freelearn.models.prediction import Status

# What a table of states needs; the design may be left out where the run has it.
KINEMATIC = ("elongation_mm", "twist_deg", "pressure_kpa")


@dataclass(frozen=True)
class Answer:
    """loads: force [N] and moment [N·m] of each row, (N, 2). stderr: one standard error of each that the parameters'
    uncertainty makes, (N, 2); NaN where that is not known. status: ok, no_equilibrium, singular or overstretched, (N,).
    """

    loads: np.ndarray
    stderr: np.ndarray
    status: list[str]


@dataclass(frozen=True)
class FittedModel:
    """A model with its parameters as fitted.

    model: the torch module. parameters: by name, SI. covariance: of the parameters in that order, (k, k), SI; NaN where
    the rows did not determine one, and for a run that fitted nothing. design: sample, gamma_deg, length_mm,
    inner_radius_mm, outer_radius_mm of each actuator in the run's table. folder: of the run.
    """

    model: Model[Any]
    parameters: dict[str, float]
    covariance: np.ndarray
    design: pd.DataFrame
    folder: Path

    def __repr__(self) -> str:
        effects = " + ".join([self.model.name, *(effect.name for effect in self.model.effects)])
        values = ", ".join(f"{name} = {value:.5g}" for name, value in self.parameters.items())
        return f"<{effects}: {values or f'{len(self.model.vector())} weights'}>"

    def table(self) -> pd.DataFrame:
        """The run's rows with their predictions: predictions.csv."""
        return pd.read_csv(self.folder / "predictions.csv")

    def predict(self, states: States | pd.DataFrame) -> Answer:
        """Loads at states, or at the rows of a table in the measurement table's columns.

        A table needs elongation_mm, twist_deg and pressure_kpa; the design's columns where the run has several samples
        and no column `sample` says which. Raises UserError.
        """
        if isinstance(states, pd.DataFrame):
            states = States.from_table(self._complete(states))
        with torch.no_grad():
            prediction = self.model(states)
        words = np.array([status.name.lower() for status in Status])[prediction.status.numpy()]
        return Answer(prediction.loads.numpy(), self._stderr(states), words.tolist())

    def _complete(self, table: pd.DataFrame) -> pd.DataFrame:
        """The table with the columns that States need."""
        lacking = [name for name in KINEMATIC if name not in table]
        if lacking:
            raise UserError(f"The table of states lacks the columns {', '.join(lacking)}: add them.")
        table = table.reset_index(drop=True)
        if not set(DESIGN) <= set(table):
            if "sample" not in table and len(self.design) > 1:
                known = ", ".join(str(n) for n in self.design["sample"])
                raise UserError(f"The run has the samples {known}: say in a column sample which is meant.")
            sample = table["sample"] if "sample" in table else self.design["sample"].iloc[0]
            table = table.drop(columns=[name for name in DESIGN if name in table]).assign(sample=sample)
            unknown = sorted(set(table["sample"]) - set(self.design["sample"]))
            if unknown:
                raise UserError(f"The run has no sample {unknown[0]}: give the design's columns {', '.join(DESIGN)}.")
            table = table.merge(self.design, on="sample", how="left")
        # Each row is a visit of its own unless the table says otherwise.
        missing = {name: 0 for name in ("sample", "step") if name not in table}
        return table.assign(**missing)

    def _stderr(self, states: States) -> np.ndarray:
        """√(J C Jᵀ) of each load, J its derivatives by the physical parameters: (N, 2)."""
        names = list(self.parameters)
        if not names or not np.isfinite(self.covariance).any():
            return np.full((len(states), 2), np.nan)
        known = np.isfinite(self.covariance.diagonal())
        covariance = torch.as_tensor(np.where(known[:, None] & known, self.covariance, 0.0))
        parts = [self._jacobian(states[rows], names) for rows in torch.arange(len(states)).split(BLOCK)]
        jacobian = torch.cat(parts)
        variance = torch.einsum("nfi,ij,nfj->nf", jacobian, covariance, jacobian)
        # A load that hangs on a parameter which nobody knows is not known either.
        lost = (jacobian[:, :, torch.as_tensor(~known)] != 0).any(-1)
        return torch.where(lost, torch.nan, variance.clamp_min(0).sqrt()).numpy()

    def _jacobian(self, states: States, names: list[str]) -> Tensor:
        values = {name: value.detach() for name, value in self.model.values().items()}
        copies = {name: values[name].expand(len(states)).clone().requires_grad_() for name in names}
        with torch.enable_grad():
            loads = self.model.chain(states, values | copies).loads
            parts = [
                torch.stack(
                    torch.autograd.grad(
                        load.sum(), list(copies.values()), retain_graph=True, allow_unused=True, materialize_grads=True
                    ),
                    dim=-1,
                )
                for load in loads.unbind(-1)
            ]
        return torch.stack(parts, dim=1)


def load(folder: str | Path) -> FittedModel:
    """The fitted model in a run's folder. Raises UserError.

    Effects and models of the user's own are read from the files that FREELEARN_EFFECTS and FREELEARN_MODELS name, and
    from nowhere else: nothing in the folder is executed.
    """
    folder = Path(folder)
    load_own_code()
    model = load_model(folder / "checkpoint.ckpt")
    parameters = model.scalars()
    try:
        content = json.loads((folder / "results.json").read_text(encoding="utf-8"))
        rows = pd.read_csv(folder / "predictions.csv", usecols=["sample", *DESIGN])
    except (OSError, ValueError) as problem:
        raise UserError(f"{folder} is not the folder of a whole run: {problem}.") from None
    covariance = np.full((len(parameters), len(parameters)), np.nan)
    if content.get("covariance"):
        stored = np.array(content["covariance"], dtype=np.float64)
        if stored.shape == covariance.shape:
            covariance = stored
    design = rows.drop_duplicates("sample").sort_values("sample").reset_index(drop=True)
    return FittedModel(model, parameters, covariance, design, folder)
