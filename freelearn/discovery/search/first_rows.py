"""Rows of a state that begins under pressure: were they reached by rising pressure, as those after them?

What depends on the direction of the pressure acts in them then; where the bed moved under that pressure it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.columns import RISEN
from freelearn.data.rows import Rows
from freelearn.data.states import begun_under_pressure, kinematic_state, pressure_direction
from freelearn.discovery.fits.derivatives import trials
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.noise.linear_algebra import left_over, orthonormal
from freelearn.discovery.noise.shapes import both_loads
from freelearn.discovery.thresholds import REACHED
from freelearn.physics.effects.registry import EFFECTS


def as_risen(rows: Rows) -> Rows:
    """The same rows, those of states that begin under pressure reached by rising pressure."""
    states = rows.states
    return replace(rows, states=states.replace(direction=torch.where(_begun(rows), 1.0, states.direction)))


def _begun(rows: Rows) -> Tensor:
    states = rows.states
    return torch.as_tensor(begun_under_pressure(states.pressure.numpy(), states.direction.numpy(), rows.state))


def risen(question: Question) -> bool:
    """Whether some effect of the direction explains the rows clearly better where those that begin under pressure count
    as reached by rising pressure, in units of χ² and in the linear model."""
    states = question.rows.states
    asked = [name for name in (*question.candidates, *question.unshown) if EFFECTS[name].directed]
    if states.members or states.recording is not None or not asked:
        return False
    if not bool(_begun(question.rows).any()):
        return False
    prepared, fit, noise = prepare(replace(question, candidates=[], unshown={}))
    rows, whiten = prepared.rows, noise.whitener()
    known = fit.jacobian.flatten(0, 1)
    if bool((rows.states.direction < 0).any()):
        # A zero of the loads does not go by the direction. Where the pressure only rises nothing tells the two apart.
        level = torch.ones(len(rows), 1, dtype=torch.float64)
        known = torch.cat([known, whiten(both_loads(level, level)).flatten(0, 1)], dim=1)
    left = left_over(fit.residual.reshape(-1), known)

    def gained(of: Rows) -> float:
        each = trials(fit, of, whiten, asked, question.on(question.given))
        return max(float((orthonormal(left_over(t.columns, known)).T @ left).square().sum()) for t in each)

    return gained(as_risen(rows)) > gained(rows) + REACHED


def marked(table: pd.DataFrame) -> pd.DataFrame:
    """A measurement table with the mark of rows that rising pressure reached, those of states that begin under pressure
    among them."""
    pressure = table["pressure_kpa"].to_numpy(np.float64)
    state = kinematic_state(table)
    begun = begun_under_pressure(pressure, pressure_direction(table, state), state)
    return table.assign(**{RISEN: begun.astype(np.int64)})
