"""A first look at two actuators: few and gentle states, after which two effects may explain what is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from hidden_effects.make import NOISE, SILENT, sized

from freelearn.data.accuracy import Accuracy
from freelearn.data.columns import usable_rows
from freelearn.data.rows import Rows
from freelearn.discovery.search.search import Findings, search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import literature, other_beds, total_energy

# Hidden effects: those that a first look often takes for another one.
EFFECTS = (
    "second_invariant", "wall_stiffening", "limited_extensibility", "twist_offset", "pressure_offset", "moment_offset",
    "force_gain", "moment_gain", "twist_compliance", "wall_thickness", "fiber_dispersion", "sensor_crosstalk",
)  # fmt: skip
# What the bed can do, and the share of it that a first look goes to.
REACH = {"elongation_mm": (-5.0, 5.0), "twist_deg": (-120.0, 120.0), "pressure_kpa": (0.0, 72.5)}
GENTLE = 0.6
STATES, SAMPLES, SIZES = (6, 8, 10), (2, 3, 4, 5, 6, 7), (6.0, 9.0)
ACCURACY = Accuracy.engineering(**NOISE)
PAUSE, PER_ROW = 10.0, 20.0


@dataclass(frozen=True)
class Truth:
    """What is really there. designs: of each sample; c1, c2 [Pa]; fx: the hidden effect in the literature's form."""

    designs: dict[int, other_beds.Design]
    c1: float
    c2: float
    fx: dict[str, dict[str, float]]

    def measured(self, before: pd.DataFrame, rows: pd.DataFrame, generator: np.random.Generator) -> pd.DataFrame:
        """The table with rows measured after it, each mounting with a position error of its own; rows without an
        equilibrium are marked as buckled. rows: sample, step, elongation, twist and pressure."""
        design = pd.DataFrame(self.designs, index=list(other_beds.DESIGN_COLUMNS)).T
        new = rows[["sample", "step", "elongation_mm", "twist_deg", "pressure_kpa"]].reset_index(drop=True)
        new = new.join(design, on="sample")
        start = float(before["time_s"].max()) + PER_ROW + PAUSE if len(before) else 0.0
        visit = np.cumsum(new["step"].to_numpy() == 0) - 1
        new["time_s"] = start + PER_ROW * np.arange(len(new)) + PAUSE * visit
        nominal = pd.concat([before, new], ignore_index=True)
        # The wall remembers the order in which its own sample was measured.
        order = np.argsort(nominal["sample"].to_numpy(), kind="stable")
        really = nominal.iloc[order].reset_index(drop=True)
        s = total_energy.state_of(really)
        moved = really.copy()
        errors = {
            name: generator.normal(0, NOISE[name], visit.max() + 1)[visit] for name in other_beds.STATE["kinematic"]
        }
        place = np.flatnonzero(order >= len(before))
        for name, error in errors.items():
            moved.loc[place, name] += error[order[place] - len(before)]
        there = total_energy.state_of(moved)
        s |= {name: there[name] for name in ("length", "twist")}
        loads, balanced = total_energy.bed_loads(s, self.c1, self.c2, self.fx, rig=literature.on_the_rig)
        back = np.empty(len(order), dtype=np.int64)
        back[order] = np.arange(len(order))
        loads, balanced = loads[back][len(before) :], balanced[back][len(before) :]
        new["pressure_kpa"] += generator.normal(0, NOISE["pressure_kpa"], len(new))
        new["force_n"] = loads[:, 0] + generator.normal(0, NOISE["force_n"], len(new))
        new["moment_nmm"] = loads[:, 1] / 1e-3 + generator.normal(0, NOISE["moment_nmm"], len(new))
        new["buckled"] = (~balanced).astype(int)
        return pd.concat([before, new], ignore_index=True)


def first_look(number: int) -> tuple[Truth, pd.DataFrame, str]:
    """A truth with one hidden effect, the table of a first look at it, and the effect's name."""
    generator = np.random.default_rng([number, 5])
    effect = EFFECTS[number % len(EFFECTS)]
    samples = sorted(int(n) for n in generator.choice(SAMPLES, 2, replace=False))
    c1, c2 = float(1e6 * 2 ** generator.uniform(-1, 1)), float(3e7 * 2 ** generator.uniform(-1, 1))
    designs = {n: (total_energy.SAMPLES[n][0], np.nan, *total_energy.SAMPLES[n][1:]) for n in samples}
    ends = np.array([REACH["elongation_mm"], REACH["twist_deg"]]) * GENTLE
    places = generator.uniform(ends[:, 0], ends[:, 1], (int(generator.choice(STATES)), 2)).round(1)
    pressures = GENTLE * REACH["pressure_kpa"][1] * np.array([0, 0.25, 0.5, 0.75, 1.0, 0.5])
    nominal = other_beds.nominal("kinematic", designs, places, pressures)

    def table(amount: float) -> pd.DataFrame:
        fx = {effect: literature.grown(effect, amount)} if amount else {}
        return other_beds.measure("kinematic", nominal, c1, c2, fx, number, SILENT, literature.on_the_rig)

    amount, _ = sized(table, float(generator.choice(SIZES)), (c1, c2), NOISE, 0.0)
    truth = Truth(designs, c1, c2, {effect: literature.grown(effect, amount)})
    return truth, truth.measured(nominal.iloc[:0], nominal, generator), effect


def usable(table: pd.DataFrame) -> tuple[pd.DataFrame, Rows]:
    """The rows that may be fitted, with the memory of the whole table."""
    place = np.flatnonzero(usable_rows(table))
    return table.iloc[place].reset_index(drop=True), Rows.from_table(table)[torch.as_tensor(place)]


def model(table: pd.DataFrame, effects: list[str]) -> Model:
    """A continuum with effects, each sample with its own value of what mounting it sets."""
    return build_model("continuum", {}, effects, sorted(int(n) for n in table["sample"].unique()))


def searched(table: pd.DataFrame, seed: int) -> Findings:
    """What the whole library makes of a table."""
    own, rows = usable(table)
    return search(question_of_rows(lambda names: model(own, list(names)), own.columns, rows, ACCURACY, seed))
