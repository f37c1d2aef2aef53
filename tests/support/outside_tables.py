"""Tables of the second test bed with physics in them that no effect of the library is, and the question they ask."""

from __future__ import annotations

from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pandas as pd
import torch
from hidden_tables import MATERIAL, NOISE

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import total_energy
from freelearn.testing.reference.laboratory import Laboratory, Measured, measure
from freelearn.testing.reference.total_energy import SAMPLES, Array, Effects, Extra
from freelearn.testing.reference.truths import outside


@dataclass(frozen=True)
class Kind:
    """Something hidden: where it is, by what the search calls that; of which inputs and of which family of forms, the
    first of several that stand for the same."""

    extra: Extra
    places: tuple[str, ...]
    inputs: tuple[str, ...]
    families: tuple[str, ...]


def bare(s: dict[str, Array]) -> Array:
    """Loads of the bed's own tube, (N, 2)."""
    return total_energy.ideal_loads(s, *MATERIAL, {})[0]


def eccentric(s: dict[str, Array], loads: Array) -> Array:
    """An encoder's disk beside its axis: the twist really imposed swings by 3°."""
    return bare(s | {"twist": s["twist"] + 0.05 * np.sin(2.2 * s["twist"] + 0.6)})


def squeezed(s: dict[str, Array], loads: Array) -> Array:
    """A wall that thickens with the square of the pressure, by 0.2 mm at the most."""
    return bare(s | {"outer": s["outer"] + 2e-4 * (s["pressure"] / 7.25e4) ** 2})


def second_rubber(s: dict[str, Array], loads: Array) -> Array:
    """A second rubber that bears from some stretch on: Ψ = a max(I₁ − 3 − 0.06, 0)²."""
    first = total_energy.rubber_energy

    def both(i1: Array, i2: Array, c1: float, fx: Effects) -> Array:
        return first(i1, i2, c1, fx) + 8e5 * np.where(i1.real > 3.06, i1 - 3.06, 0) ** 2

    with patch.object(total_energy, "rubber_energy", both):
        return bare(s)


KINDS = {
    "bent_force_cell": Kind(outside("bent_force_cell", 4.0), ("measurement force",), ("force",), ("power",)),
    "cogging": Kind(outside("cogging", 6.0), ("parallel torsional", "measurement moment"), ("twist",), ("sine",)),
    "slack_cable": Kind(
        outside("slack_cable", 6.0), ("parallel axial", "measurement force"), ("elongation",), ("hinge",)
    ),
    "gear_bias": Kind(outside("gear_bias", 5.0), ("parallel torsional", "measurement moment"), ("twist",), ("sign",)),
    "eccentric": Kind(eccentric, ("boundary twist",), ("twist",), ("sine",)),
    "squeezed": Kind(squeezed, ("geometry outer_radius",), ("pressure",), ("polynomial", "power")),
    "second_rubber": Kind(second_rubber, ("energy i1",), ("i1",), ("hinge",)),
}  # fmt: skip


def measured(
    extra: Extra | None = None,
    effects: Effects | None = None,
    samples: tuple[int, ...] = (3, 6),
    seed: int = 1,
    states: int = 40,
    pressures: int = 4,
    **more,
) -> Measured:
    """So many states of each sample at rising pressures and one falling one."""
    laboratory = Laboratory(states=states, pressures=pressures, falling=1, actuators="paper", forms="package", **more)
    actuators = {n: SAMPLES[n] for n in samples}
    return measure(laboratory, actuators, *MATERIAL, effects or {}, NOISE, seed, extra)


def asked(table: pd.DataFrame, candidates=(), seed: int = 0) -> Question:
    samples = sorted(table["sample"].unique().tolist())
    rows = Rows.from_table(table)[torch.as_tensor(np.flatnonzero(table["buckled"] == 0))]
    return Question(lambda names: build_model("continuum", {}, names, samples), list(candidates), rows, PAPER, seed)
