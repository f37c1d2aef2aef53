"""What rows are expected to tell, a plan's or a user's own: from their table alone, so that both are judged alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from freelearn.design.goals import Goal
from freelearn.design.known import Known, standing
from freelearn.design.view import View, refitted, remaining, value
from freelearn.measurements.states import States, kinematic_state


@dataclass(frozen=True)
class Told:
    """One thing that rows tell, in σ. name: what. before: by what is measured; after: with the rows. gain, and prior:
    what the rows add to the criterion and what it was before (view.View). errors_before, errors_after: standard errors
    of the coefficients of interest, (q,), in their own unit. shares: σ that every row adds, (n,), squares of which add
    up."""

    name: tuple[str, ...]
    before: float
    after: float
    prior: float
    gain: float
    errors_before: np.ndarray
    errors_after: np.ndarray
    shares: np.ndarray


@dataclass(frozen=True)
class Score:
    """told: of every view. answered: (n,) bool, rows of which all models have an answer; the others tell nothing."""

    told: list[Told]
    answered: np.ndarray

    @property
    def weakest(self) -> Told:
        """What is told least."""
        return min(self.told, key=lambda told: told.gain)


def score(known: Known, goal: Goal, table: pd.DataFrame) -> Score:
    """Of a table's rows, in the order in which they would be measured."""
    states = standing(States.from_table(table), known.rows.states)
    tellings, answered = goal.tellings(known, states)
    whiten = known.noise(states, torch.as_tensor(kinematic_state(table)))
    told = []
    for telling in tellings:
        heard = torch.where(answered[:, None, None], telling.columns, 0.0)
        columns = whiten(heard).numpy()
        view = View.scaled(telling.name, columns[:, None], telling.known, telling.interest)
        flat = view.columns.reshape(-1, view.columns.shape[-1])
        total = view.known + flat.T @ flat
        direction = refitted(total, view.interest).sum(1)
        shares = np.sqrt(np.square(view.columns[:, 0] @ direction).sum(1))
        left = [remaining(m, view.interest) for m in (view.known, total)]
        prior, now = (float(value(m, view.interest)) for m in (view.known, total))
        before, after = (max(float(m.sum()), 0.0) ** 0.5 for m in left)
        # What refitting to the rows costs in what was measured before is theirs too.
        shares *= (max(after**2 - before**2, 0.0) / max(float(np.square(shares).sum()), 1e-300)) ** 0.5
        errors = [np.sqrt(np.diagonal(np.linalg.pinv(m, hermitian=True)).clip(0)) for m in left]
        told.append(Told(telling.name, before, after, prior, now - prior, errors[0], errors[1], shares))
    return Score(told, answered.numpy())
