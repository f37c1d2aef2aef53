"""Small measurement tables for tests."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.bed.virtual import DESIGNS


def random_table(count: int, seed: int) -> pd.DataFrame:
    """Rows at random states of the paper's samples, in the measurement table's format, loads zero."""
    generator = np.random.default_rng(seed)
    sample = generator.integers(0, len(DESIGNS), count)
    design = np.array(DESIGNS)[sample]
    return pd.DataFrame(
        {
            "sample": sample + 1,
            "gamma_deg": design[:, 0],
            "length_mm": design[:, 1],
            "inner_radius_mm": design[:, 2],
            "outer_radius_mm": design[:, 3],
            "step": 0,
            "elongation_mm": generator.uniform(-5, 5, count),
            "twist_deg": generator.uniform(-120, 120, count),
            "pressure_kpa": generator.uniform(0, 72.5, count),
            "force_n": 0.0,
            "moment_nmm": 0.0,
            "buckled": 0,
        }
    )
