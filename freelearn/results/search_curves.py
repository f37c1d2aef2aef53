"""What the first and the last model of a search predict: in the rows looked at, and along pressures of some states."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from freelearn.answer.bands import Bands
from freelearn.inference.covariance import parameter_covariance
from freelearn.inference.search import Findings
from freelearn.inference.step import Step
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.states import States, kinematic_state
from freelearn.models.predicted import predicted_table
from freelearn.results.curve import StateCurves, state_curves
from freelearn.results.curve_rows import curves_of
from freelearn.results.states import pick_states
from freelearn.results.suspects import flagged


def search_predictions(findings: Findings, table: pd.DataFrame, states: States) -> dict[str, pd.DataFrame]:
    """The table with the loads of the first model (before) and of the last one (after), in the columns of a run's
    predictions.csv. states: of the table's rows, with the memory of the whole table."""
    with torch.no_grad():
        return {when: predicted_table(table, "train", step.fit.model(states)) for when, step in _ends(findings).items()}


def search_curves(
    findings: Findings, before: pd.DataFrame, states: States, accuracy: Accuracy, banded: bool
) -> list[StateCurves]:
    """Curves of the first and the last model at a middling and at the worst state of the first, and at that of the
    worst suspect. before, states: of search_predictions. banded: with the 95 % bands."""
    models = {when: step.fit.model for when, step in _ends(findings).items()}
    table = flagged(before, findings.suspects)
    picked = pick_states(table)[1:]
    if findings.suspects:
        worst = max(findings.suspects, key=lambda suspect: abs(suspect.sigmas))
        if not any(worst.row in rows for rows in picked):
            curve = curves_of(table, kinematic_state(table))
            picked.append(np.flatnonzero(curve == curve[worst.row]))
    # The states and not the table, which lacks the buckled rows: the path of the pressure went through them.
    return state_curves(models, table, picked, states, _bands(findings, accuracy) if banded else {})


def _ends(findings: Findings) -> dict[str, Step]:
    return {"before": findings.steps[0], "after": findings.final}


def _bands(findings: Findings, accuracy: Accuracy) -> dict[str, Bands | None]:
    """How far a new measurement may lie from what the first and the last model say, fitted on all rows."""
    rows = findings.rows
    fitted = torch.ones(len(rows), dtype=torch.bool)

    def of(step: Step) -> Bands | None:
        return Bands.of(step.fit.model, rows, fitted, parameter_covariance(step).numpy(), accuracy)

    first, last = findings.steps[0], findings.final
    before = of(first)
    return {"before": before, "after": before if last is first else of(last)}
