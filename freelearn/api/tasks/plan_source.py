"""The run that a plan goes on from, and what its user asks a plan for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.api.settings.run_settings import PlanSettings
from freelearn.api.tasks.preparation import measuring
from freelearn.common.errors import UserError, unknown
from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.columns import members_in
from freelearn.data.rows import Rows
from freelearn.data.sets import rows_of_set
from freelearn.discovery.fits.derivatives import none_vector
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import normal_inverse
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.chain.prediction import usable
from freelearn.physics.effects.registry import EFFECTS, missing_columns
from freelearn.physics.models.build import build_model
from freelearn.queries.next_measurements.goals import DETECT, DISCRIMINATE, NARROW, Discriminate, Goal, Narrow
from freelearn.queries.next_measurements.known_rows import Known
from freelearn.records.provenance import Provenance
from freelearn.records.run_files import read_run

# The run that a plan goes on from: its rows, its model and the members of its classes.

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
        return self.known.fitted(model, start.clamp(*model.raw_bounds()))


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
    rows = Rows.from_table(table)[torch.as_tensor(place)].told()
    own = [name for name in table if name not in ADDED and "_pred_" not in str(name)]
    start = model.vector().detach().clone()
    return Known.from_rows(table.loc[place, own].reset_index(drop=True), rows, model, start, accuracy)


# What a user asks a plan for, as a goal with fitted models behind it.


def goal_of(settings: PlanSettings, source: Source) -> Goal:
    """The goal. Raises UserError where the run has nothing of the kind."""
    if settings.goal == DETECT:
        return _detect(source, str(settings.effect))
    if settings.goal == NARROW:
        return _narrow(source, str(settings.parameter))
    classes = source.classes()
    if classes:
        return Discriminate.from_fits(classes)
    if settings.goal == DISCRIMINATE:
        what = "its verdict is " + str(source.content["verdict"]) if source.kind == "discover" else "it is one of train"
        raise UserError(
            f"{source.folder} has no class of effects to discriminate, {what}: choose goal=detect or goal=narrow."
        )
    return _narrow(source, widest(source))


def widest(source: Source) -> str:
    """The parameter with the widest interval for its size; of those that nothing is known of, none."""
    fit = source.known.fit
    variance = normal_inverse(fit.jacobian.flatten(0, 1)).diagonal().clamp_min(0)
    width = {}
    for label, parameter in fit.model.declared.items():
        place = fit.model.labels().index(label)
        size = _size(parameter, fit, label)
        if float(variance[place]) > 0 and (parameter.log or fit.values()[label] != 0):
            width[label] = float(variance[place]) ** 0.5 / size
    if not width:
        raise UserError(f"{source.folder} has no parameter whose interval is known: choose goal=detect, effect=NAME.")
    return max(width, key=lambda label: width[label])


def _narrow(source: Source, name: str) -> Goal:
    fit = source.known.fit
    if name not in fit.model.declared:
        raise unknown("parameter", name, fit.model.declared)
    return Narrow(NARROW, ((name,),), fit, (name,), (_size(fit.model.declared[name], fit, name),))


def _detect(source: Source, name: str) -> Goal:
    if name not in EFFECTS:
        raise unknown("effect", name, EFFECTS)
    known, model = source.known, source.model
    if name in source.effects:
        fit = known.fit
    else:
        more = source.build([*source.effects, name])
        if lacking := missing_columns(more.effects, known.table.columns):
            raise UserError(lacking)
        if reason := EFFECTS[name].untold(known.rows.states.bed.name):
            raise UserError(f"{name} cannot be settled: it {reason}.")
        fit = known.unfitted(more, none_vector(more, known.fit))
        model = more
    own = {label: p for label, p in model.declared.items() if label.startswith(f"{name}.")}
    # What is undefined without the effect is no sign of it.
    own = {label: p for label, p in own.items() if p.none is not None} or own
    sizes = tuple(_size(p, fit, label) for label, p in own.items())
    return Narrow(DETECT, ((name,),), fit, tuple(own), sizes)


def _size(parameter: Parameter, fit: WhiteFit, label: str) -> float:
    """What counts as one of a raw parameter: its own value, or where it has none a noticeable one."""
    if parameter.log:
        return 1.0
    with torch.no_grad():
        value = abs(float(fit.model.physical(fit.vector)[label]))
    return value or abs(parameter.scale or parameter.start) or 1.0


def present_value(goal: Narrow) -> np.ndarray:
    """Physical values of a goal's parameters, SI, (q,)."""
    assert goal.fit is not None
    with torch.no_grad():
        values = goal.fit.model.physical(goal.fit.vector)
    return np.array([float(values[label]) for label in goal.labels])
