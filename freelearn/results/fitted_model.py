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
from freelearn.measurements.beds import BED, KINEMATIC, Bed, bed_of
from freelearn.measurements.members import DESIGN, SECOND, design_column, members_in, pressure_column
from freelearn.measurements.states import States
from freelearn.models.base import BLOCK, Model
from freelearn.models.build import load_model
from freelearn.models.own import load_own_code
from freelearn.models.prediction import Status


@dataclass(frozen=True)
class Answer:
    """loads: force [N] and moment [N·m] of each row, (N, 2), or what else the bed measures, SI. stderr: one standard
    error of each that the parameters' uncertainty makes, (N, 2); NaN where that is not known. status: ok,
    no_equilibrium, singular or overstretched, (N,).
    """

    loads: np.ndarray
    stderr: np.ndarray
    status: list[str]
    bed: Bed

    def table(self) -> pd.DataFrame:
        """What the bed measures as predicted, in the columns and units of predictions.csv, each with its standard error
        (force_pred_n, force_pred_n_stderr), and the status."""
        columns: dict[str, Any] = {}
        for i, quantity in enumerate(self.bed.readings):
            if quantity in self.bed.measured:
                columns[quantity.predicted] = self.loads[:, i] / quantity.factor
                columns[f"{quantity.predicted}_stderr"] = self.stderr[:, i] / quantity.factor
        return pd.DataFrame(columns | {"status": self.status})


@dataclass(frozen=True)
class FittedModel:
    """A model with its parameters as fitted.

    model: the torch module. parameters: by name, SI. covariance: of the parameters in that order, (k, k), SI; NaN where
    the rows did not determine one, and for a run that fitted nothing. design: sample, gamma_deg, length_mm,
    inner_radius_mm, outer_radius_mm of each actuator in the run's table (of an end block, all its members'). folder: of
    the run. bed: that of the run's table. members: of an end block, by number.
    """

    model: Model[Any]
    parameters: dict[str, float]
    covariance: np.ndarray
    design: pd.DataFrame
    folder: Path
    bed: Bed
    members: list[int]

    def __repr__(self) -> str:
        effects = " + ".join([self.model.name, *(effect.name for effect in self.model.effects)])
        values = ", ".join(f"{name} = {value:.5g}" for name, value in self.parameters.items())
        return f"<{effects}: {values or f'{len(self.model.vector())} weights'}>"

    def table(self) -> pd.DataFrame:
        """The run's rows with their predictions: predictions.csv."""
        return pd.read_csv(self.folder / "predictions.csv")

    def predict(self, states: States | pd.DataFrame) -> Answer:
        """Loads at states, or at the rows of a table in the measurement table's columns; or what else the bed measures.

        A table needs what the run's bed imposes (elongation_mm, twist_deg and pressure_kpa, or under a dead load
        force_n and moment_nmm in place of the first two; each actuator's pressure of an end block); the design's
        columns where the run has several samples and no column `sample` says which. Raises UserError.
        """
        if isinstance(states, pd.DataFrame):
            states = States.from_table(self._complete(states))
        with torch.no_grad():
            prediction = self.model(states)
        words = np.array([status.name.lower() for status in Status])[prediction.status.numpy()]
        return Answer(prediction.loads.numpy(), self._stderr(states), words.tolist(), states.bed)

    def _complete(self, table: pd.DataFrame) -> pd.DataFrame:
        """The table with the columns that States need."""
        design = [str(name) for name in self.design if name != "sample"]
        members = [pressure_column(m) for m in self.members]
        imposed = [*(quantity.column for quantity in self.bed.state), *(members or ["pressure_kpa"])]
        lacking = [name for name in imposed if name not in table]
        if lacking:
            raise UserError(f"The table of states lacks the columns {', '.join(lacking)}: add them.")
        table = table.reset_index(drop=True)
        if not set(design) <= set(table):
            if "sample" not in table and len(self.design) > 1:
                known = ", ".join(str(n) for n in self.design["sample"])
                raise UserError(f"The run has the samples {known}: say in a column sample which is meant.")
            sample = table["sample"] if "sample" in table else self.design["sample"].iloc[0]
            table = table.drop(columns=[name for name in design if name in table]).assign(sample=sample)
            unknown = sorted(set(table["sample"]) - set(self.design["sample"]))
            if unknown:
                raise UserError(f"The run has no sample {unknown[0]}: give the design's columns {', '.join(design)}.")
            table = table.merge(self.design, on="sample", how="left")
        # Each row is a visit of its own unless the table says otherwise.
        missing: dict[str, Any] = {name: 0 for name in ("sample", "step") if name not in table}
        if members:
            missing["pressure_kpa"] = table[members].mean(axis=1)
        if self.bed is not KINEMATIC:
            missing[BED] = self.bed.name
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
        rows = pd.read_csv(folder / "predictions.csv")
    except (OSError, ValueError) as problem:
        raise UserError(f"{folder} is not the folder of a whole run: {problem}.") from None
    covariance = np.full((len(parameters), len(parameters)), np.nan)
    if content.get("covariance"):
        stored = np.array(content["covariance"], dtype=np.float64)
        if stored.shape == covariance.shape:
            covariance = stored
    design = rows.drop_duplicates("sample").sort_values("sample").reset_index(drop=True)
    members = members_in(design.columns)
    names = [*DESIGN, SECOND, *(design_column(name, m) for m in members for name in (*DESIGN, SECOND))]
    design = design[["sample", *(name for name in names if name in design)]]
    return FittedModel(model, parameters, covariance, design, folder, bed_of(rows), members)
