"""Fresh states to judge a model by: within the box that was measured, and beyond it. True loads, without noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from beyond_library.kind import Array
from beyond_library.make import Made
from hidden_effects.make import NOISE

from freelearn.testing.reference.laboratory import HIGHEST_KPA, PAUSE, SECONDS_PER_ROW, STRETCH, TWIST_DEG
from freelearn.testing.reference.laboratory import PAPER_SLENDER as SLENDER
from freelearn.testing.reference.total_energy import DEG, KPA, MM, state_of

# Kinematic states of each actuator, rising and falling pressures of each, and how far beyond the box.
STATES, RISING, FALLING, BEYOND = 40, 4, 2, 1.3


@dataclass(frozen=True)
class Fresh:
    """A measurement table with true loads, rows without an equilibrium marked as buckled. counted: (N,) rows to judge
    by. own: (N, 2) standard deviation of a new reading by its sensor and pressure, N and N·m; whole: with the place."""

    table: pd.DataFrame
    loads: Array
    counted: Array
    own: Array
    whole: Array


def fresh(made: Made, beyond: bool, seed: int) -> Fresh:
    """Other states of the same actuators, drawn evenly from the box that was measured, or from around it.

    beyond: at least one of elongation, twist and pressure is outside of the box, by up to 30 % of its half (pressure:
    of the whole). Times stay within those that were measured.
    """
    table = _planned(made, beyond, np.random.default_rng([seed, 7, beyond]))
    s = state_of(table)
    loads, balanced = made.truth.loads(s)
    table["force_n"], table["moment_nmm"] = np.nan_to_num(loads[:, 0]), np.nan_to_num(loads[:, 1]) / MM
    table["buckled"] = (~balanced).astype(int)
    outside = table.pop("outside").to_numpy()
    # A truth without an equilibrium a little aside has no stiffness either.
    own, whole = _noise(made, s, loads, balanced)
    good = balanced & np.isfinite(whole).all(1)
    return Fresh(table, loads, good & outside if beyond else good, own, whole)


def _planned(made: Made, beyond: bool, generator: np.random.Generator) -> pd.DataFrame:
    factor, rows, parts = BEYOND if beyond else 1.0, RISING + FALLING, []
    for number, (gamma, length, inner, outer) in made.actuators.items():
        places = generator.uniform(-factor, factor, (STATES, 2))
        rising = np.sort(generator.uniform(0, factor, (STATES, RISING)), axis=1)
        falling = -np.sort(-generator.uniform(0, rising[:, -1:], (STATES, FALLING)), axis=1)
        pressure = np.concatenate([rising, falling], axis=1).ravel()
        reach = np.array([STRETCH * length, TWIST_DEG * min(1.0, length / outer / SLENDER)])
        # Some states of the whole run, the first of them at its beginning: clocks count from there.
        run = float(made.table.loc[made.table["sample"] == number, "time_s"].max())
        slots = int(run // (rows * SECONDS_PER_ROW + PAUSE))
        chosen = np.r_[0, np.sort(generator.choice(np.arange(1, slots), STATES - 1, replace=slots <= STATES))]
        begins = chosen * (rows * SECONDS_PER_ROW + PAUSE)
        part = pd.DataFrame({"sample": number, "gamma_deg": gamma, "length_mm": length}, index=range(STATES * rows))
        part = part.assign(inner_radius_mm=inner, outer_radius_mm=outer, step=np.tile(np.arange(rows), STATES))
        part["elongation_mm"], part["twist_deg"] = np.repeat(places * reach, rows, axis=0).T
        part["pressure_kpa"] = HIGHEST_KPA * pressure
        part["time_s"] = np.repeat(begins, rows) + SECONDS_PER_ROW * part["step"]
        part["outside"] = (np.abs(np.repeat(places, rows, axis=0)) > 1).any(1) | (pressure > 1)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _noise(made: Made, s: dict[str, Array], loads: Array, balanced: Array) -> tuple[Array, Array]:
    """Standard deviation of a new reading of either load, (N, 2) N and N·m: without and with the error of the place.

    The true noise of the bed, also where the laboratory states another one. Errors of place and pressure are seen
    through the truth's own stiffness."""
    share = np.abs(loads) / np.abs(loads[balanced]).max(0, initial=1e-12)
    sensor = np.array([NOISE["force_n"], NOISE["moment_nmm"] * MM]) * (1 + made.laboratory.growth * share)
    squares = []
    units = {"pressure": ("pressure_kpa", KPA), "length": ("elongation_mm", MM), "twist": ("twist_deg", DEG)}
    for name, (column, unit) in units.items():
        error = NOISE[column] * unit
        ends = [made.truth.loads(s | {name: s[name] + side * error})[0] for side in (1, -1)]
        squares.append(((ends[0] - ends[1]) / 2) ** 2)
    own = sensor**2 + squares[0]
    return np.sqrt(own), np.sqrt(own + squares[1] + squares[2])
