"""The 95 % bands of what a bed measures, at the states that it imposes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import DEAD_LOAD, INFLATION
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.queries.inverse.held_out import held_out
from freelearn.queries.inverse.miss import COVERAGE, Miss
from freelearn.queries.inverse.raw_covariance import RawCovariance
from freelearn.queries.inverse.system import System
from freelearn.records.left_out_readings import LeftOutReadings

SAME = torch.ones(2, dtype=torch.float64)


@dataclass(frozen=True)
class Bands:
    """model: as fitted. miss: how far a measurement may lie from it. diameter: half of the band of an outer diameter
    [m], NaN where none was measured."""

    model: Model
    miss: Miss
    diameter: float

    @classmethod
    def from_model(
        cls,
        model: Model,
        rows: Rows,
        fitted: Tensor,
        covariance: np.ndarray,
        accuracy: Accuracy | None,
        by_states: bool = True,
        left: LeftOutReadings | None = None,
    ) -> Bands | None:
        """Of a model fitted on some of the rows, fitted (N,) bool; None where no row tells how far it misses.

        covariance: of the declared parameters, SI (k, k), NaN where one is not known. accuracy: of the measuring.
        by_states, left: whether a new measurement may be of a state that was not visited, and what is known of
        how far it lies off then (see held_out)."""
        if not len(rows):
            return None
        parameters = RawCovariance.from_model(model, covariance)
        held = held_out(model, rows, fitted, by_states, parameters, left)
        return cls(model, Miss.from_held_out(held, parameters, accuracy), _diameter(model, rows)) if len(held) else None

    def around(self, model: Model) -> Bands:
        """The same of another model, of whose parameters nothing is known."""
        count = len(model.declared)
        unknown = RawCovariance.from_model(model, np.full((count, count), np.nan))
        return Bands(model, replace(self.miss, parameters=unknown), self.diameter)

    def half(self, states: States, shown: Tensor) -> np.ndarray:
        """Half of the band of what the bed measures, (N, 2) SI; NaN where nothing tells it. shown: (N, 2), what the
        model says of it."""
        system = System.placed(self.model, states, shown)
        x, both = system.x, (0, 1)
        _, slopes = system.slopes(x)
        # Its place is what a bed measures that hangs loads: found from them.
        hung = states.bed is DEAD_LOAD and system.mechanical
        inputs, outputs = self.miss.half_width(system, x, slopes, both if hung else (), both, SAME)
        half: np.ndarray = (inputs if hung else outputs).numpy()
        if states.bed is INFLATION:
            half = np.c_[half[:, 0], np.full(len(half), self.diameter)]
        return half


def _diameter(model: Model, rows: Rows) -> float:
    """What held 95 % of the outer diameters measured [m]."""
    if rows.states.bed is not INFLATION:
        return float("nan")
    with torch.no_grad():
        shown = model(rows.states).loads
    missed = (shown - rows.readings.value)[rows.readings.present[:, 1], 1].abs()
    return float(torch.quantile(missed, COVERAGE)) if len(missed) else float("nan")
