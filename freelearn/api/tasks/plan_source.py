"""The run that a plan goes on from: its rows, its model and the members of its classes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.api.tasks.measuring import measuring
from freelearn.design.known import Known
from freelearn.errors import UserError
from freelearn.inference.white_fit import WhiteFit
from freelearn.measurements.accuracy import PAPER, Accuracy
from freelearn.measurements.members import members_in
from freelearn.measurements.rows import Rows
from freelearn.measurements.sets import rows_of_set
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.predicted import usable
from freelearn.results.origin import Provenance
from freelearn.results.run_folder import read_run

# Columns that a run adds to its table.
ADDED = ("split", "status")
# Beyond, a model is a network: what its weights are tells nothing.
MOST_PARAMETERS = 60


@dataclass(frozen=True)
class Source:
    """kind: discover or train. content: of discovery.json or results.json. known: the rows and the last model. model:
    its name. samples, members: that effects have parameters of their own for."""

    folder: Path
    kind: str
    content: Mapping[str, Any]
    known: Known
    samples: tuple[int, ...]
    members: int
    notes: tuple[str, ...]

    @property
    def model(self) -> Model[Any]:
        """The last model, as fitted."""
        return self.known.fit.model

    @property
    def effects(self) -> list[str]:
        """All that the last model has."""
        return [effect.name for effect in self.model.effects]

    @property
    def provenance(self) -> Provenance:
        """Where the rows came from."""
        return Provenance.from_plain(self.content.get("data", {}))

    def build(self, effects: list[str]) -> Model[Any]:
        """A fresh model with these effects."""
        return build_model(self.model.name, {}, effects, self.samples, self.members, self.model.known)

    def classes(self) -> list[dict[str, WhiteFit]]:
        """The classes of more than one library effect, each member with its fit. Raises UserError."""
        try:
            return self._classes()
        except (TypeError, KeyError, AttributeError, ValueError):
            raise UserError(f"The classes in {self.folder} are not as discover wrote them: run it again.") from None

    def _classes(self) -> list[dict[str, WhiteFit]]:
        several = [c for c in self.content.get("alternatives", []) if len(c) > 1]
        if not several and any(len(c) > 1 for c in self.content.get("classes", [])):
            if "alternatives" in self.content:
                return []
            raise UserError(f"{self.folder} comes from a version that kept no fits of a class: run discover again.")
        return [{name: self._member(entry) for name, entry in members.items()} for members in several]

    def _member(self, entry: Mapping[str, Any]) -> WhiteFit:
        model = build_model(self.model.name, {}, entry["effects"], entry["samples"], entry["members"], self.model.known)
        start = model.vector().detach().clone()
        for i, label in enumerate(model.labels()):
            if entry["vector"].get(label) is not None:
                start[i] = entry["vector"][label]
        return self.known.fitted(model, start)


def source_of(folder: Path) -> Source:
    """The run in a folder. Raises UserError where there is none, or none that a plan can go on from."""
    run = read_run(folder)
    if len(run.model.vector()) > MOST_PARAMETERS:
        count = len(run.model.vector())
        raise UserError(f"{run.model.name} has {count} weights: a plan needs a model whose parameters mean something.")
    table = rows_of_set(run.table, str(run.content["train"])).reset_index(drop=True)
    accuracy, notes = run.accuracy, []
    if accuracy is None:
        judged = measuring(run.model, table, None)
        accuracy = judged.accuracy if judged else PAPER
        notes = list(judged.notes) if judged else ["the accuracy of the measuring is not known: the paper's is assumed"]
    known = _known(table, run.model, accuracy)
    kind = "discover" if "verdict" in run.content else "train"
    description = run.model.description()
    several = run.content.get("per_sample") and table["sample"].nunique() > 1
    samples = [int(n) for n in np.unique(table["sample"])] if several else description["samples"]
    members = len(members_in(table.columns)) if run.content.get("per_sample") else description["members"]
    return Source(folder, kind, run.content, known, tuple(samples), members, tuple(notes))


def _known(table: pd.DataFrame, model: Model[Any], accuracy: Accuracy) -> Known:
    """Of the rows with an answer; what they remember is that of the whole table."""
    place = usable(table).index.to_numpy(copy=True)
    if not len(place):
        raise UserError("The run has no usable row with an answer: there is nothing to go on from.")
    rows = Rows.from_table(table)[torch.as_tensor(place)]
    own = [name for name in table if name not in ADDED and "_pred_" not in str(name)]
    start = model.vector().detach().clone()
    return Known.of(table.loc[place, own].reset_index(drop=True), rows, model, start, accuracy)
