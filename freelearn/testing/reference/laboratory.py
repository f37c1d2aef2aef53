"""How a laboratory measures: its actuators, how short its protocol is, how its sensors err, and what slips."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from freelearn.testing.reference import literature, total_energy
from freelearn.testing.reference.total_energy import DEG, KPA, MM, Effects, Extra, Rig, bed_loads, ideal_loads, state_of

# Slips of the hand and of the sensor: readings that are not what the load cell saw, put where they are known.

Array = np.ndarray[Any, Any]
LOADS = ("force_n", "moment_nmm")
# What a wrong unit multiplies a reading by: a force read in pounds, a moment in micronewton-meters.
UNIT_FACTOR = {"force_n": 0.2248, "moment_nmm": 1000.0}


def _other_row(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    same = np.flatnonzero((table["sample"] == table["sample"].iloc[row]) & (table["buckled"] == 0))
    return float(table[load].iloc[int(generator.choice(same[same != row]))])


def _sign(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return -float(table[load].iloc[row])


def _decimal(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[row] * generator.choice([10.0, 0.1]))


def _unit(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[row] * UNIT_FACTOR[load])


def _stuck(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[max(row - 1, 0)])


# Kind → the reading that stands in the row: (table of true readings, row, load, generator).
KINDS: dict[str, Callable[[pd.DataFrame, int, str, np.random.Generator], float]] = {
    "other_row": _other_row,
    "sign": _sign,
    "decimal": _decimal,
    "unit": _unit,
    "stuck": _stuck,
}


def slip(
    table: pd.DataFrame, share: float, kinds: Sequence[str], deviation: Mapping[str, Array], seed: Sequence[int]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The table with one reading wrong in a share of its rows, at least in one, and the truth about them.

    deviation: standard deviation of each load's sensor at every row, in the table's units. Buckled rows have no
    readings that count, and so no slips. The truth: row (position in the table), load, kind, displacement (in the
    table's unit) and sensor_sigmas, the displacement's size in the sensor's own standard deviations.
    """
    truth = pd.DataFrame(columns=["row", "load", "kind", "displacement", "sensor_sigmas"])
    places = np.flatnonzero(table["buckled"] == 0)
    if share <= 0 or len(places) < 2:
        return table, truth.astype({"row": int, "displacement": float, "sensor_sigmas": float})
    generator = np.random.default_rng(seed)
    count = min(max(1, round(share * len(places))), len(places))
    slipped, found = table.copy(), []
    for row in sorted(generator.choice(places, count, replace=False).tolist()):
        load, kind = str(generator.choice(LOADS)), str(generator.choice(list(kinds)))
        reading = KINDS[kind](table, row, load, generator)
        change = reading - float(table[load].iloc[row])
        slipped.loc[slipped.index[row], load] = reading
        # A silent sensor has no deviation to measure the slip by.
        sigma = float(deviation[load][row])
        sigmas = abs(change) / sigma if sigma > 0 else np.inf
        found.append({"row": row, "load": load, "kind": kind, "displacement": change, "sensor_sigmas": sigmas})
    return slipped, pd.DataFrame(found)


# Number → Γ [deg], L, R_i, R_o [mm].
Actuators = Mapping[int, tuple[float, float, float, float]]

HIGHEST_KPA = 72.5
# Largest elongation as a share of the length; largest twist [deg], of an actuator with the paper's L/R_o or more.
STRETCH, TWIST_DEG, PAPER_SLENDER = 0.05, 120.0, 100 / 6.4
# Places in elongation and twist that a protocol chooses from, and how far it then strays, as a share of their spacing.
PLACES, JITTER = (11, 26), 0.3
SECONDS_PER_ROW, PAUSE = 20.0, 10.0
# How mounted actuators behave, by what hidden effects are made of.
RIGS: dict[str, Rig] = {"literature": literature.on_the_rig, "package": total_energy.on_the_rig}


@dataclass(frozen=True)
class Laboratory:
    """How measurements are made.

    states: kinematic states per sample. pressures: rising levels of each; falling: rows after them; begins: the lowest
    level [kPa], to which the tube is filled from none; readings: rows at each level. isobaric: under each level the
    length goes forth and back through as many places instead, each row a state of its own. order: of the
    states, "random" or "sorted" by elongation, then twist. actuators: whose, "paper" or "random".
    tails: degrees of freedom of Student's t, which all noise has (inf: normal); its standard deviation stays the
    stated one. growth: a load cell's standard deviation is (1 + growth |load|/largest |load|) times the stated one.
    slipped: share of rows with one wrong reading, of these kinds (see `slips.KINDS`). misstated: the accuracy that the
    laboratory tells is this many times its true one. forms: what hidden effects are made of, see `literature`.
    """

    states: int = 60
    pressures: int = 5
    falling: int = 2
    begins: float = 0.0
    readings: int = 1
    isobaric: bool = False
    order: Literal["random", "sorted"] = "random"
    actuators: Literal["paper", "random"] = "random"
    tails: float = np.inf
    growth: float = 0.0
    slipped: float = 0.0
    kinds: tuple[str, ...] = ("other_row", "sign")
    misstated: float = 1.0
    forms: Literal["literature", "package"] = "literature"

    def told(self, accuracy: Mapping[str, float]) -> dict[str, float]:
        """The accuracy that the laboratory states, from its true one."""
        return {name: self.misstated * value for name, value in accuracy.items()}


@dataclass(frozen=True)
class Measured:
    """table: a measurement table. slips: the truth about its wrong readings, see `slips.slip`, and all_sigmas, the
    displacement in standard deviations of the whole noise: the sensor's, and the pressure's and the place's through the
    stiffness of the bare actuator."""

    table: pd.DataFrame
    slips: pd.DataFrame


def random_actuators(count: int, generator: np.random.Generator) -> dict[int, tuple[float, float, float, float]]:
    """Actuators of about the paper's proportions: number → Γ [deg], L, R_i, R_o [mm]."""
    made = {}
    for number in range(1, count + 1):
        inner = generator.uniform(3, 7)
        outer = inner * (1 + generator.uniform(0.25, 0.4))
        gamma, length = generator.uniform(15, 76), generator.uniform(80, 150)
        made[number] = tuple(round(float(x), 2) for x in (gamma, length, inner, outer))
    return made  # type: ignore[return-value]


def protocol(laboratory: Laboratory, actuators: Actuators, generator: np.random.Generator) -> pd.DataFrame:
    """A measurement table without loads: what the laboratory sets out to impose."""
    if laboratory.isobaric:
        return _sweeps(laboratory, actuators, generator)
    lowest = laboratory.begins
    pressure = np.r_[
        np.linspace(lowest, HIGHEST_KPA, laboratory.pressures),
        np.linspace(HIGHEST_KPA, lowest, laboratory.falling + 1)[1:],
    ].repeat(laboratory.readings)
    rows, parts = len(pressure), []
    for number, (gamma, length, inner, outer) in actuators.items():
        places = np.stack(np.meshgrid(*(np.linspace(-1, 1, n) for n in PLACES), indexing="ij"), -1).reshape(-1, 2)
        chosen = generator.choice(len(places), laboratory.states, replace=laboratory.states > len(places))
        stray = generator.uniform(-JITTER, JITTER, (laboratory.states, 2)) * 2 / (np.array(PLACES) - 1)
        reach = STRETCH * length, TWIST_DEG * min(1.0, length / outer / PAPER_SLENDER)
        at = (np.clip(places[chosen] + stray, -1, 1) * reach).round(2)
        if laboratory.order == "sorted":
            at = at[np.lexsort((at[:, 1], at[:, 0]))]
        part = pd.DataFrame({"sample": number, "gamma_deg": gamma, "length_mm": length}, index=range(len(at) * rows))
        part = part.assign(inner_radius_mm=inner, outer_radius_mm=outer, step=np.tile(np.arange(rows), len(at)))
        part["elongation_mm"], part["twist_deg"] = np.repeat(at, rows, axis=0).T
        part["pressure_kpa"] = np.tile(pressure, len(at))
        part["time_s"] = SECONDS_PER_ROW * np.arange(len(part)) + PAUSE * np.repeat(np.arange(len(at)), rows)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _sweeps(laboratory: Laboratory, actuators: Actuators, generator: np.random.Generator) -> pd.DataFrame:
    """Forth and back through the lengths, at one twist, under one pressure after the other."""
    parts = []
    for number, (gamma, length, inner, outer) in actuators.items():
        forth = (np.linspace(-1, 1, laboratory.states) * STRETCH * length).round(2)
        both = np.r_[forth, forth[-2::-1]]
        turn = TWIST_DEG * min(1.0, length / outer / PAPER_SLENDER) * generator.uniform(-0.5, 0.5)
        levels = np.linspace(laboratory.begins, HIGHEST_KPA, laboratory.pressures)
        rows = range(len(both) * len(levels))
        part = pd.DataFrame({"sample": number, "gamma_deg": gamma, "length_mm": length}, index=rows)
        part = part.assign(inner_radius_mm=inner, outer_radius_mm=outer, twist_deg=round(turn, 2))
        part["elongation_mm"], part["pressure_kpa"] = np.tile(both, len(levels)), np.repeat(levels, len(both))
        # Where one sweep ended the next begins: the bed stands, and the pressure changes.
        part["step"] = (part["elongation_mm"].diff() == 0).astype(int)
        parts.append(part.assign(time_s=SECONDS_PER_ROW * np.arange(len(part))))
    return pd.concat(parts, ignore_index=True)


def measure(
    laboratory: Laboratory,
    actuators: Actuators,
    c1: float,
    c2: float,
    fx: Effects,
    accuracy: Mapping[str, float],
    seed: int,
    extra: Extra | None = None,
) -> Measured:
    """What the laboratory's measuring gives: rows without an equilibrium are marked as buckled.

    accuracy: the true one, one standard deviation in the table's units. The protocol depends on the seed alone, so that
    two calls differ in nothing but what else differs.
    """

    def shown(s: dict[str, Array]) -> tuple[Array, Array]:
        return bed_loads(s, c1, c2, fx, extra, RIGS[laboratory.forms])

    table, slips, s, deviation = measure_loads(laboratory, actuators, shown, accuracy, seed)
    rows = slips["row"].to_numpy(dtype=np.int64)
    imposed = _imposed_noise({name: value[rows] for name, value in s.items()}, c1, c2, accuracy)
    column = np.array([LOADS.index(load) for load in slips["load"]], dtype=np.int64)
    sensor = np.array([deviation[load][row] for load, row in zip(slips["load"], rows, strict=True)])
    whole = np.hypot(sensor, imposed[np.arange(len(rows)), column])
    return Measured(table, slips.assign(all_sigmas=np.abs(slips["displacement"]) / np.maximum(whole, 1e-300)))


def measure_loads(
    laboratory: Laboratory,
    actuators: Actuators,
    shown: Callable[[dict[str, Array]], tuple[Array, Array]],
    accuracy: Mapping[str, float],
    seed: int,
) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, Array], dict[str, Array]]:
    """A measurement table, the truth about its slips, the states that were really imposed, and the standard deviation
    of each load's sensor in every row.

    shown: states → loads (N, 2) N and N·m without noise, and whether there is an equilibrium, (N,).
    """
    table = protocol(laboratory, actuators, np.random.default_rng([seed, 1]))
    generator = np.random.default_rng([seed, 2])
    states = np.cumsum(table["step"].to_numpy() == 0) - 1
    count = int(states[-1]) + 1

    def noise(name: str, size: int) -> Array:
        return accuracy[name] * _unit_noise(laboratory.tails, size, generator)

    actual = table.copy()
    for name in ("elongation_mm", "twist_deg"):
        actual[name] += noise(name, count)[states]
    s = state_of(table) | {n: v for n, v in state_of(actual).items() if n in ("length", "twist")}
    loads, balanced = shown(s)
    table["pressure_kpa"] += noise("pressure_kpa", len(table))
    deviation = {}
    for name, load in zip(LOADS, (loads[:, 0], loads[:, 1] / MM), strict=True):
        share = np.abs(load) / max(float(np.abs(load[balanced]).max(initial=0.0)), 1e-12)
        grown = 1 + laboratory.growth * np.nan_to_num(np.minimum(share, 1.0))
        deviation[name] = accuracy[name] * grown
        table[name] = load + noise(name, len(table)) * grown
    table["buckled"] = (~balanced).astype(int)
    return *slip(table, laboratory.slipped, laboratory.kinds, deviation, [seed, 3]), s, deviation


def _imposed_noise(s: dict[str, Array], c1: float, c2: float, accuracy: Mapping[str, float]) -> Array:
    """Standard deviation of the loads, (N, 2) N and N·mm, that comes of errors of place and pressure."""
    square = np.zeros((len(s["length"]), 2))
    units = {"length": ("elongation_mm", MM), "twist": ("twist_deg", DEG), "pressure": ("pressure_kpa", KPA)}
    for name, (column, unit) in units.items():
        error = accuracy[column] * unit
        ends = [ideal_loads(s | {name: s[name] + side * error}, c1, c2, {})[0] for side in (1, -1)]
        square += ((ends[0] - ends[1]) / 2 / [1, MM]) ** 2
    return np.asarray(np.sqrt(square))


def _unit_noise(tails: float, size: int, generator: np.random.Generator) -> Array:
    """Noise of standard deviation one, normal or of Student's t with more than two degrees of freedom."""
    if np.isinf(tails):
        return np.asarray(generator.normal(size=size))
    return np.asarray(generator.standard_t(tails, size) * np.sqrt((tails - 2) / tails))
