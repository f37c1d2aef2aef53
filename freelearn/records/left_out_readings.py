"""What fits say of readings whose kinematic state they did not see, beside what was measured: columns of a table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.beds import Quantity, bed_of
from freelearn.data.rows import Rows
from freelearn.discovery.fits.step import Step, heldout_stderr


class LeftOutReadings(NamedTuple):
    """missed: what such a fit says less what was measured; stderr: the standard error that its parameters make of it.
    Both (N, 2) SI, NaN where there is none."""

    missed: Tensor
    stderr: Tensor

    @classmethod
    def from_step(cls, step: Step, rows: Rows) -> LeftOutReadings:
        """Of a search's step. rows: its own."""
        present = rows.readings.present
        return cls(*(torch.where(present, told, torch.nan) for told in (step.heldout.raw, heldout_stderr(step))))

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> LeftOutReadings | None:
        """Of columns as `columns` has them; None where there are none."""
        missed, stderr = (torch.full((len(table), 2), torch.nan, dtype=torch.float64) for _ in range(2))
        quantities = [(i, q) for i, q in enumerate(bed_of(table).readings) if {*_names(q), q.column} <= set(table)]
        for i, quantity in quantities:
            shown, error = (table[name].to_numpy(np.float64) for name in _names(quantity))
            missed[:, i] = torch.as_tensor((shown - table[quantity.column].to_numpy()) * quantity.factor)
            stderr[:, i] = torch.as_tensor(error * quantity.factor)
        return cls(missed, stderr) if quantities else None

    def columns(self, rows: Rows, kept: np.ndarray) -> dict[str, np.ndarray]:
        """What such fits say, and its standard errors, for a table of which these are some rows, `kept`."""
        told = dict[str, np.ndarray]()
        for i, quantity in enumerate(rows.states.bed.readings):
            if not bool(rows.readings.present[:, i].any()):
                continue
            shown = rows.readings.value + self.missed
            for name, values in zip(_names(quantity), (shown, self.stderr), strict=True):
                told[name] = np.full(len(kept), np.nan)
                told[name][kept] = values[:, i].numpy() / quantity.factor
        return told

    def of(self, rows: Tensor | np.ndarray) -> LeftOutReadings:
        """Those of some rows."""
        return LeftOutReadings(self.missed[rows], self.stderr[rows])


def _names(quantity: Quantity) -> tuple[str, str]:
    return quantity.left_out, f"{quantity.left_out}_stderr"
