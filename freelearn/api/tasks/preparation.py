"""What a command prepares: mistakes told at once, where it computes, what is known of parameters and accuracy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import pandas as pd
import torch

from freelearn.api.settings.parse import mistakes_error
from freelearn.api.settings.settings import AccuracySettings, DiscoverSettings, Settings
from freelearn.common.errors import UserError, unknown
from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.beds import Quantity, bed_of
from freelearn.data.rows import Rows
from freelearn.discovery.fits.estimated_accuracy import estimate
from freelearn.discovery.fits.white_fit import WhiteFit, evaluated
from freelearn.fitting.options import LEVENBERG_MARQUARDT, NORMAL, PROFILE
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import usable
from freelearn.physics.models.build import MODELS, build_model
from freelearn.physics.models.stated_knowledge import stated


def resolve_device(name: str) -> str:
    """cpu or cuda, from cpu, cuda or auto. Raises UserError where there is no such device."""
    there = torch.cuda.is_available()
    if name == "auto":
        return "cuda" if there else "cpu"
    if name == "cuda" and not there:
        raise UserError("device=cuda: PyTorch finds no CUDA device here; choose device=cpu, or device=auto.")
    return name


Result = TypeVar("Result")


class Mistakes:
    """Runs checks that do not depend on each other, and raises one UserError for all that failed."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def check(self, call: Callable[[], Result]) -> Result | None:
        """What the call gives; None where it raised a UserError, which is kept."""
        try:
            return call()
        except UserError as mistake:
            self.sentences.append(str(mistake))
            return None

    def tell(self) -> None:
        """Raises UserError where there were mistakes."""
        if self.sentences:
            raise mistakes_error(self.sentences)


# What settings say of parameters beforehand.


def own_values(settings: Settings) -> dict[str, float]:
    """Values of the model's own parameters, SI, by name."""
    return {name: value for name, value in settings.model.values.items() if "." not in name}


def known_of(settings: Settings) -> Known:
    """What is known of the parameters. Raises UserError."""
    chosen = settings.model
    known = stated(
        chosen.name,
        settings.effects,
        chosen.values,
        chosen.errors,
        settings.fix,
        settings.bounds,
        settings.material,
        settings.priors,
        tried=isinstance(settings, DiscoverSettings),
    )
    fit = settings.fit
    if known.priors and fit and (fit.name != LEVENBERG_MARQUARDT or fit.intervals == PROFILE):
        raise UserError(
            f"{', '.join(known.priors)} with an error needs fit={LEVENBERG_MARQUARDT} and intervals={NORMAL}, as other "
            "fits and profiles do not heed it: choose these, or fix the value."
        )
    return known


def known_model(settings: Settings) -> Model:
    """The model with its effects and what is known of it, before there are data. Raises UserError."""
    name = settings.model.name
    known = known_of(settings) if name in MODELS else None
    return build_model(name, own_values(settings), settings.effects, known=known)


def check_numbers(known: Known, model: Model) -> None:
    """Whether each sample or member named by its number, as in length_offset.length[3], is there. Raises UserError."""
    for label in dict.fromkeys([*known.starts, *known.fixed, *known.bounds, *known.priors]):
        own = [name for name in model.declared if name.split("[")[0] == label.split("[")[0]]
        if "[" in label and own and label not in model.declared:
            raise unknown("parameter", label, own)


# How well the bed measured: as stated, or judged from a fitted model's residuals.

# Fewer rows do not tell how accurate they are.
FEWEST = 40


@dataclass(frozen=True)
class Measuring:
    """accuracy: one standard deviation of each quantity. notes: how it is known, where it was not stated."""

    accuracy: Accuracy
    notes: list[str]


def measuring(model: Model, predictions: pd.DataFrame, stated: AccuracySettings | None) -> Measuring | None:
    """The stated accuracy, or an estimate from the model's residuals; None where too few rows tell it.

    predictions: whole samples, in the columns of predictions.csv.
    """
    if stated is not None:
        return Measuring(stated.si(bed_of(predictions)), [])
    predictions = predictions.reset_index(drop=True)
    place = usable(predictions).index.to_numpy(copy=True)
    if len(place) < FEWEST:
        return None
    rows = Rows.from_table(predictions)
    rows = rows[torch.as_tensor(place)]
    return estimated(evaluated(model, rows, model.vector().detach()), rows)


def _beyond(rows: Rows, quantity: Quantity, error: float) -> bool:
    """Whether an error is larger than all the range in which a quantity was set: of a model that has run away."""
    values = getattr(rows.states, quantity.field, None)
    read = np.zeros(0) if values is None else values.detach().cpu().numpy()
    read = read[np.isfinite(read)]
    return len(read) > 0 and error > float(np.ptp(read)) > 0


def estimated(fit: WhiteFit, rows: Rows) -> Measuring:
    """Judged from a fit's residuals over rows, with what a reader should know of it."""
    accuracy, how = estimate(fit, rows, PAPER)
    bed = rows.states.bed

    def sizes(quantities: Sequence[Quantity]) -> list[str]:
        return [f"{q.name} {getattr(accuracy, q.error) / q.factor:.3g} {q.unit}".replace(" °", "°") for q in quantities]

    own = ", ".join(sizes(bed.measured))
    common = f"{' and '.join(sizes(bed.state))} per state (their ratio is the paper's)"
    if any(_beyond(rows, q, getattr(accuracy, q.error)) for q in bed.state):
        names = " and ".join(q.name for q in bed.state)
        common = f"of {names} nothing can be told, for the model is too far off"
    note = f"accuracy estimated from {how}: {common}, {own}"
    return Measuring(accuracy, [note])
