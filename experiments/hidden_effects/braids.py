"""Tubes of one and of two families of fibers, and how the plan `braids` measures them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from freelearn.testing.reference import literature, other_beds, total_energy

# Γ, Γ₂ [deg], L, R_i, R_o [mm].
Designs = dict[int, other_beds.Design]
SAMPLES = (2, 3, 4, 5, 6, 7)
# kPa: six rising, four falling. Muscles bear more than the paper's tubes.
BRAID_KPA = np.r_[np.linspace(0, 250, 6), 175.0, 100.0, 25.0, 0.0]
HELIX_KPA = np.r_[np.linspace(0, 72.5, 6), 50.0, 30.0, 7.5, 0.0]
# Most contraction, as a share of the length; states of each sample.
CONTRACTION, LENGTHS, PLACES = 0.16, 13, 40
TWIST_DEG = 60.0


def planned(tubes: str, kind: str, generator: np.random.Generator) -> tuple[Designs, pd.DataFrame]:
    """Two actuators, and what the bed sets out to impose on them."""
    if tubes == "helix":
        chosen = generator.choice(SAMPLES, 2, replace=False)
        designs = {
            int(n): (total_energy.SAMPLES[int(n)][0], np.nan, *total_energy.SAMPLES[int(n)][1:]) for n in sorted(chosen)
        }
        places = np.stack([generator.uniform(-5, 5, PLACES), generator.uniform(-120, 120, PLACES)], axis=1)
        return designs, other_beds.nominal(kind, designs, places.round(2), HELIX_KPA)
    designs = {number: _braid(generator) for number in (1, 2)}
    most = CONTRACTION * min(design[2] for design in designs.values())
    if kind == "isometric":
        places = np.stack([generator.permutation(np.linspace(0.0, -most, LENGTHS)), np.zeros(LENGTHS)], axis=1)
    else:
        twist = generator.uniform(-TWIST_DEG, TWIST_DEG, PLACES)
        places = np.stack([generator.uniform(-most, 0.02 * most, PLACES), twist], axis=1)
    return designs, other_beds.nominal(kind, designs, places.round(2), BRAID_KPA)


def _braid(generator: np.random.Generator) -> other_beds.Design:
    """A muscle of usual proportions."""
    gamma, length, inner = generator.uniform(20, 40), generator.uniform(100, 200), generator.uniform(4, 8)
    gamma, length, inner = round(gamma, 1), round(length, 1), round(inner, 2)
    return gamma, -gamma, length, inner, round(inner * generator.uniform(1.2, 1.35), 2)


def measure(
    kind: str,
    plan: pd.DataFrame,
    c1: float,
    c2: float,
    fx: total_energy.Effects,
    seed: int,
    accuracy: Mapping[str, float],
) -> pd.DataFrame:
    """The table that the bed gives, effects in the literature's forms."""
    return other_beds.measure(kind, plan, c1, c2, fx, seed, accuracy, literature.on_the_rig)
