"""How well the bed measured: as stated, or judged from a fitted model's residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
import torch

from freelearn.api.settings.settings import AccuracySettings
from freelearn.inference.accuracy import estimate
from freelearn.inference.white_fit import WhiteFit, evaluated
from freelearn.measurements.accuracy import PAPER, Accuracy
from freelearn.measurements.beds import Quantity
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model
from freelearn.models.predicted import usable

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
        return Measuring(stated.si(), [])
    predictions = predictions.reset_index(drop=True)
    place = usable(predictions).index.to_numpy(copy=True)
    if len(place) < FEWEST:
        return None
    rows = Rows.from_table(predictions)
    rows = rows[torch.as_tensor(place)]
    return estimated(evaluated(model, rows, model.vector().detach()), rows)


def estimated(fit: WhiteFit, rows: Rows) -> Measuring:
    """Judged from a fit's residuals over rows, with what a reader should know of it."""
    accuracy, how = estimate(fit, rows, PAPER)
    bed = rows.states.bed

    def sizes(quantities: Sequence[Quantity]) -> list[str]:
        return [f"{q.name} {getattr(accuracy, q.error) / q.factor:.3g} {q.unit}".replace(" °", "°") for q in quantities]

    common, own = " and ".join(sizes(bed.state)), ", ".join(sizes(bed.measured))
    note = f"accuracy estimated from {how}: {common} per state (their ratio is the paper's), {own}"
    return Measuring(accuracy, [note])
