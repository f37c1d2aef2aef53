"""What is measured already, and models fitted to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.estimated_accuracy import measured
from freelearn.discovery.fits.prepare import noise_about
from freelearn.discovery.fits.white_fit import WhiteFit, evaluated, white_fit
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.noise.scatter import clock_of
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status


@dataclass(frozen=True)
class Known:
    """Rows that are measured, and the noise about the model that explains them best.

    table: in the measurement table's columns, the N rows alone. rows: the same. fit: of that model, whose stiffness
    says how noisy a row is. whiten: of that noise, as it was found to be.
    """

    table: pd.DataFrame
    rows: Rows
    fit: WhiteFit
    whiten: Whitener

    @classmethod
    def from_rows(cls, table: pd.DataFrame, rows: Rows, model: Model, vector: Tensor, accuracy: Accuracy) -> Known:
        """From a model and its raw vector (p,), which is fitted once more. accuracy: as stated."""
        model.set_vector(vector)
        whiten = noise_about(evaluated(model, rows, vector), rows, accuracy).whitener()
        return cls(table, rows, white_fit(model, rows, whiten, vector), whiten)

    def fitted(self, model: Model, vector: Tensor) -> WhiteFit:
        """Another model, fitted to the rows from a raw vector (p,)."""
        return white_fit(model, self.rows, self.whiten, vector)

    def unfitted(self, model: Model, vector: Tensor) -> WhiteFit:
        """Another model at a raw vector (p,), as it is."""
        model.set_vector(vector)
        at = evaluated(model, self.rows, vector)
        return replace(at, residual=self.whiten(at.raw_residual), jacobian=self.whiten(at.raw_jacobian))

    def information(self, fit: WhiteFit) -> np.ndarray:
        """What the rows tell of a fit's raw parameters, (p, p); heavy tails hold less than a normal error."""
        flat = fit.jacobian.flatten(0, 1)
        return np.asarray((flat.T @ flat * self.whiten.efficiency).numpy())

    def noise(self, states: States, state: Tensor) -> Whitener:
        """Of rows that are to be measured as those were. state: number of each row's kinematic state, (n,)."""
        found = self.whiten.scatter
        assert found is not None
        accuracy, clock = measured(found, states.bed), clock_of(states)
        sensitivity = sensitivities(self.fit.model, states)
        if found.memory is None or clock is None:
            return Whitener(sensitivity, state, accuracy, bed=states.bed)
        usual = torch.ones(len(states), 2, dtype=torch.float64)
        alike = replace(found, position=1.0, reading=usual, weight=usual, state=usual[:, 0])
        return Whitener(sensitivity, state, accuracy, alike, states.bed, clock=clock)


@dataclass(frozen=True)
class Ahead:
    """A fit at n rows that nobody has measured. shown (n, 2) SI; by_vector (n, 2, p); answered (n,) bool."""

    shown: Tensor
    by_vector: Tensor
    answered: Tensor


def ahead(fit: WhiteFit, states: States) -> Ahead:
    """What a fit says of states, and how it depends on its raw parameters; zero where it has no answer."""
    fit.model.set_vector(fit.vector)
    with torch.no_grad():
        answered = fit.model(states).status == Status.OK
    blank = torch.zeros(len(states), 2, dtype=torch.float64)
    there = evaluated(fit.model, Rows.whole(states, blank), fit.vector)
    answered = answered & there.raw_residual.isfinite().all(-1) & there.raw_jacobian.isfinite().all(-1).all(-1)
    shown = torch.where(answered[:, None], there.raw_residual, 0.0)
    return Ahead(shown, torch.where(answered[:, None, None], there.raw_jacobian, 0.0), answered)


def standing(states: States, known: States) -> States:
    """States as they will be when they are measured after those known: later, the bed standing still, the wall worked
    as hard as it ever was."""
    later = _later(states, known)
    if later.recording is None:
        return later
    return later.replace(recording=later.recording.with_states(_later(later.recording.states, known)))


def _later(states: States, known: States) -> States:
    changes = {name: torch.zeros_like(states.length) for name in ("moved_length", "moved_twist")}
    clock, past = states.dwell.clone(), states.past_severity.clone()
    for number in torch.unique(states.sample).tolist():
        here, before = states.sample == number, known.sample == number
        if bool(before.any()):
            clock[here] += known.clock[before].max()
            past[here] = past[here].clamp_min(float(known.past_severity[before].max()))
    return states.replace(clock=clock, past_severity=past, **changes)
