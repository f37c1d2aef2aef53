"""A network trained the other way: from loads and pressure to the place, as the paper proposes."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.fitting.options import LEVENBERG_MARQUARDT, FitOptions
from freelearn.physics.models.mlp import MLP

# As conf/fit/levenberg_marquardt.yaml has them.
OPTIONS = FitOptions(LEVENBERG_MARQUARDT, max_epochs=1000, restarts=4, patience=6, race=25)
# Of the rows that the other network saw, this share says when to stop: the paper's 16 % beside 64 %.
VALIDATION = 0.2


def backwards(rows: Rows, seed: int) -> MLP:
    """The network fitted to rows of a bed that imposes places, with loads and places exchanged. Raises UserError.

    rows: those that the forward network was fitted on."""
    # Lightning takes seconds to import.
    from freelearn.fitting.fit import fit

    whole = rows[torch.nonzero(rows.readings.present.all(-1))[:, 0]]
    turned = Rows(under_load(whole.states, whole.loads), Readings.whole(_place(whole.states)), whole.state)
    order = torch.randperm(len(turned), generator=torch.Generator().manual_seed(seed))
    count = int(VALIDATION * len(turned))
    model = MLP()
    fit(model, turned[order[count:]], turned[order[:count]], OPTIONS, seed)
    return model


def under_load(states: States, loads: Tensor) -> States:
    """The same states as of a bed that hangs loads (N, 2) on the actuators."""
    return states.replace(bed=DEAD_LOAD, force=loads[:, 0], moment=loads[:, 1])


def _place(states: States) -> Tensor:
    """Elongation and twist, (N, 2)."""
    return torch.stack([states.length - states.reference_length, states.twist], dim=-1)
