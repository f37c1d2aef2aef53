"""The curves of a run, and of a search's first and last model, at a few states."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.discovery.fits.step import Step, parameter_covariance
from freelearn.discovery.search.search import Findings
from freelearn.physics.chain.prediction import answered, predicted_table
from freelearn.queries.curves.curve_rows import curves_of
from freelearn.queries.curves.model_curves import StateCurves, state_curves
from freelearn.queries.curves.shown_states import pick_states
from freelearn.queries.inverse.bands import Bands
from freelearn.records.left_out_readings import LeftOutReadings
from freelearn.records.run import Run, seen_rows
from freelearn.records.suspected_readings import flagged


def run_curves(run: Run, own: pd.DataFrame, banded: bool, by_states: bool) -> list[StateCurves]:
    """Curves at the best, a middling and the worst predicted state. own: rows of the samples that were fitted, in the
    columns of predictions.csv; banded: with the bands; by_states: whether whole kinematic states were held out."""
    # First what needs no states: of many rows they take as much as the table.
    name, picked, rows = run.model.name, pick_states(own), Rows.from_table(own)
    bands = {name: run_bands(run, own, rows, by_states)} if banded else {}
    return state_curves({name: run.model}, own, picked, rows.states, bands)


def run_bands(run: Run, own: pd.DataFrame, rows: Rows, by_states: bool) -> Bands | None:
    """How far a new measurement may lie from what the run's model says; None where no row tells it.

    own, by_states: as of run_curves; rows: all of own."""
    seen = seen_rows(run.model, own["split"]) if run.uncertainty else np.zeros(len(own), dtype=bool)
    compared = answered(own)
    if not compared.all():
        rows, seen = rows[torch.as_tensor(compared)], seen[compared]
    fitted = torch.tensor(seen)
    return Bands.from_model(run.model, rows, fitted, run.covariance, run.accuracy, by_states)


# What the first and the last model of a search predict: in the rows looked at, and along pressures of some states.


def search_predictions(findings: Findings, table: pd.DataFrame, states: States) -> dict[str, pd.DataFrame]:
    """The table with the loads of the first model (before) and of the last one (after), in the columns of a run's
    predictions.csv, and with what fits say that did not see a row's state. states: of the table's rows, with the memory
    of the whole table."""
    with torch.no_grad():
        told = {when: predicted_table(table, "train", step.fit.model(states)) for when, step in _ends(findings).items()}
    rows, kept = findings.rows, findings.kept
    return {
        when: told[when].assign(**LeftOutReadings.from_step(step, rows).columns(rows, kept))
        for when, step in _ends(findings).items()
    }


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


def step_bands(step: Step, rows: Rows, accuracy: Accuracy) -> Bands | None:
    """How far a new measurement may lie from what a search's step says, fitted on all of its rows."""
    fitted, known = torch.ones(len(rows), dtype=torch.bool), parameter_covariance(step).numpy()
    left = LeftOutReadings.from_step(step, rows)
    return Bands.from_model(step.fit.model, rows, fitted, known, accuracy, left=left)


def _bands(findings: Findings, accuracy: Accuracy) -> dict[str, Bands | None]:
    """Those of the first and of the last model."""
    first, last = findings.steps[0], findings.final
    before = step_bands(first, findings.rows, accuracy)
    return {"before": before, "after": before if last is first else step_bands(last, findings.rows, accuracy)}
