"""The rubber's strain energy fitted to tests of rubber alone."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
import torch

from freelearn.data.specimen_table import Specimens
from freelearn.fitting.rubber_effects import NEO_HOOKEAN, best_effects, compare, conclusion
from freelearn.fitting.rubber_fit import RubberFit, fit_rubber
from freelearn.physics.models.rubber import Rubber

__all__ = ["NEO_HOOKEAN", "compared_specimens", "fitted_specimens"]


def fitted_specimens(data: Specimens, effects: Sequence[str], held_out: Sequence[str]) -> tuple[RubberFit, RubberFit]:
    """The fit with the effects, and that of the neo-Hookean solid alone. held_out: modes that are predicted only.
    Raises UserError."""
    torch.set_num_threads(1)
    fit = fit_rubber(Rubber(effects), data.table, held_out)
    return fit, fit_rubber(Rubber(), data.table, held_out) if effects else fit


def compared_specimens(data: Specimens) -> tuple[pd.DataFrame, str, tuple[str, ...]]:
    """All combinations of effects, each mode held out in turn, what that says, and the effects that the tests ask for.
    Raises UserError."""
    torch.set_num_threads(1)
    compared = compare(data.table, data.modes)
    return compared, conclusion(compared), best_effects(compared)
