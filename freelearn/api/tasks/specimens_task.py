"""The rubber's strain energy, and its relaxation, fitted to tests of rubber alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from freelearn.data.specimen_table import Specimens
from freelearn.data.specimen_tests import names_of, timed
from freelearn.fitting.rubber_effects import NEO_HOOKEAN, best_effects, compare, conclusion
from freelearn.fitting.rubber_fit import RubberFit, fit_rubber, to_fit
from freelearn.fitting.rubber_relaxation import (
    asked_energies,
    best_energy,
    best_relaxation,
    compare_energies,
    compare_relaxations,
    each_held_out,
    relaxation_of,
)
from freelearn.physics.models.relaxation import POWER, Relaxation
from freelearn.physics.models.rubber import Rubber

__all__ = [
    "NEO_HOOKEAN", "POWER", "Fitted", "compared_specimens", "fitted_specimens", "has_recordings", "relaxations",
    "wanted_relaxation",
]  # fmt: skip


@dataclass(frozen=True)
class Fitted:
    """fit: with the effects; alone: of the neo-Hookean solid, with the same relaxation. apart: of recordings, error of
    each test when the others are fitted alone, by name; empty where some are held out, or nothing is recorded."""

    fit: RubberFit
    alone: RubberFit
    apart: Mapping[str, float]


def has_recordings(data: Specimens) -> bool:
    """Whether some of the tests have a time."""
    return bool(timed(data.table).any())


def wanted_relaxation(data: Specimens, kind: str, softened: bool) -> Relaxation:
    """kind: a number of arms, or POWER. Raises UserError where no recording tells of it."""
    return relaxation_of(int(kind) if kind.isdecimal() else kind, softened, data.table)


def relaxations(data: Specimens, effects: Sequence[str], held_out: Sequence[str]) -> tuple[pd.DataFrame, Relaxation]:
    """All relaxations that the recordings tell of, each test held out in turn, and the one that they ask for. held_out:
    tests that have no say. Raises UserError."""
    torch.set_num_threads(1)
    names = names_of(data.table)
    seen = data.table[np.isin(names, to_fit(list(dict.fromkeys(names)), held_out))].reset_index(drop=True)
    compared = compare_relaxations(seen, effects)
    return compared, best_relaxation(compared, data.table)


def fitted_specimens(
    data: Specimens, effects: Sequence[str], held_out: Sequence[str], relaxation: Relaxation | None = None
) -> Fitted:
    """held_out: modes and recordings that are predicted only. Raises UserError."""
    torch.set_num_threads(1)
    rubber = Rubber(effects, relaxation)
    fit = fit_rubber(rubber, data.table, held_out)
    alone = fit_rubber(Rubber((), relaxation), data.table, held_out) if effects else fit
    return Fitted(fit, alone, each_held_out(data.table, rubber, fit) if relaxation is not None and not held_out else {})


def compared_specimens(data: Specimens) -> tuple[pd.DataFrame, str, tuple[str, ...]]:
    """All combinations of effects, each mode held out in turn, or of recordings each test; what that says, and the
    effects that the tests ask for. Raises UserError."""
    torch.set_num_threads(1)
    if has_recordings(data):
        compared = compare_energies(data.table)
        return compared, asked_energies(compared), best_energy(compared)
    compared = compare(data.table, data.modes)
    return compared, conclusion(compared), best_effects(compared)
