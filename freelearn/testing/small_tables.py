"""Small measurement tables for tests."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.physics.simulated_bed import DESIGNS


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


def visits(count: int = 4, seed: int = 0, samples: tuple[int, ...] = (3, 5)) -> pd.DataFrame:
    """Kinematic states at random places of the samples, with three pressures up and one down, without loads.

    The rows of a state are half a minute apart, the states an hour.
    """
    generator = np.random.default_rng(seed)
    rows: list[tuple[float, ...]] = []
    for sample in samples:
        for _ in range(count):
            place = generator.uniform(-4, 3), generator.choice([-1, 1]) * generator.uniform(15, 110)
            for step, pressure in enumerate((0.0, 35.0, 70.0, 30.0)):
                time = 30.0 * step + 900.0 * (len(rows) - step)
                rows.append((sample, *DESIGNS[sample - 1], step, *place, pressure, time))
    head = ["sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "step", "elongation_mm"]
    return pd.DataFrame(rows, columns=[*head, "twist_deg", "pressure_kpa", "time_s"])


def recordings(samples: tuple[int, ...] = (3, 5)) -> pd.DataFrame:
    """A log: two recordings of each sample, unevenly sampled, in which pressure, length and twist go up and down at
    rates of their own, without loads."""
    parts = []
    for sample in samples:
        design = dict(
            zip(("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"), DESIGNS[sample - 1], strict=True)
        )
        for run, (rate, count) in enumerate(((1.3, 14), (0.7, 11)), start=1):
            time = np.cumsum(np.r_[0.0, 0.15 + 0.1 * (np.arange(count - 1) % 3)])
            moved = {
                "sample": sample,
                **design,
                "step": np.arange(count),
                "elongation_mm": 1.5 * np.sin(0.9 * rate * time) - 1.0,
                "twist_deg": 60.0 + 25.0 * np.cos(1.1 * rate * time),
                "pressure_kpa": 36.0 - 33.0 * np.cos(2.3 * rate * time),
                "time_s": time,
                "run": run,
            }
            parts.append(pd.DataFrame(moved))
    return pd.concat(parts, ignore_index=True)
