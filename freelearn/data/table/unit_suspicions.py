"""Columns whose numbers suggest another unit, or another sign, than their names say."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pandas as pd

from freelearn.data.beds import DEG, FORCE, KPA, MM, bed_of
from freelearn.data.columns import used_rows
from freelearn.data.flicker import flickers, stood
from freelearn.data.logs import is_log

# What is said about columns whose numbers suggest another unit than their names say.


class UnitWarning(str):
    """A suspicion that a column is in another unit: what is computed from it means nothing until somebody looks.

    column, factor: which column would have to be multiplied by what, where that is all; "" and 1 where it is not."""

    column: str
    factor: float

    def __new__(cls, says: str, column: str = "", factor: float = 1.0) -> UnitWarning:
        """says: one sentence."""
        made = super().__new__(cls, says)
        made.column, made.factor = column, factor
        return made


# Which loads rise with their own place, where a tube without pressure is a spring.

# Share of the pressures' range that counts as hardly any, fewest rows there, and the slope of a load by its own place,
# in standard errors, that no spring has.
CALM, FEWEST_CALM, RISES = 0.1, 8, 4.0


def signs(used: pd.DataFrame) -> Iterator[str]:
    """A sentence for each load that rises: stretched, a spring pulls (F falls), and turned, it turns back (M falls)."""
    pressure = used["pressure_kpa"]
    calm = used[pressure <= pressure.min() + CALM * (pressure.max() - pressure.min())]
    calm = calm[calm["slack"] != 1] if "slack" in calm else calm
    places = [name for name in ("elongation_mm", "twist_deg") if name in calm and calm[name].nunique() >= 3]
    for load, place in (("force_n", "elongation_mm"), ("moment_nmm", "twist_deg")):
        if load not in calm or place not in places:
            continue
        rows = calm[[load, place, *(name for name in places if name != place), "sample"]].dropna()
        if len(rows) >= FEWEST_CALM and _rise(rows) > RISES:
            yield UnitWarning(
                f"{load} may have its sign turned: at the lowest pressures it rises with {place}, as if the tube drove "
                "itself on, where a spring would pull back.",
                load,
                -1.0,
            )


def _rise(rows: pd.DataFrame) -> float:
    """Slope of the first column by the second, the others held, in standard errors; each sample has its own level."""
    apart = rows.drop(columns="sample") - rows.groupby("sample").transform("mean")
    load, places = apart.iloc[:, 0].to_numpy(), apart.iloc[:, 1:].to_numpy()
    inverse = np.linalg.pinv(places.T @ places, hermitian=True)
    slope = inverse @ places.T @ load
    freedom = len(rows) - rows["sample"].nunique() - len(slope)
    left = float(((load - places @ slope) ** 2).sum()) / max(freedom, 1)
    error = (left * inverse[0, 0]) ** 0.5
    return float(slope[0] / error) if error > 0 else 0.0


# Which columns' numbers suggest another unit, or another sign, than their names say.

INCH_MM = 25.4
PSI_KPA = 6.894757
ATMOSPHERE_KPA = 101.3
# The largest twist of a bed, ±120°, is 2.1 rad.
LARGEST_TWIST_RAD = 2.2
# Outer radius [mm] below which a short tube whose diameter is measured is taken for a blood vessel, or a part of one,
# and the least and largest shares of its length by which such are stretched.
VESSEL_MM, LEAST_STRAIN, LARGEST_STRAIN = 5.0, -0.5, 1.0
# Below 1 mm it may be a mouse's carotid artery, or an actuator in inches: by the highest pressure [kPa], 300 mmHg.
NARROWEST_MM, NARROW_KPA = 0.1, 40.0
# Shares of the pressure's thrust on the bore, and of that and a soft wall's spring [Pa], beyond which no table's
# largest force is: of measured and simulated actuators it was 0.24 to 96 times the thrust.
LEAST_OF_THRUST, MOST_OF_LOADS, WALL_PA = 0.03, 300.0, 1e6


def _lengths(used: pd.DataFrame) -> Iterator[str]:
    length, outer = used["length_mm"].median(), used["outer_radius_mm"].median()
    if length < 1:
        yield f"length_mm looks like meters (median {length:.4g}): in mm it would be {1000 * length:.4g}."
    elif length < 20 and (outer < 1 or outer > length / 4) and not _vessel(used):
        yield (
            f"length_mm may be in inches or centimeters (median {length:.4g}, short for an actuator): "
            f"in mm it would be {INCH_MM * length:.4g} or {10 * length:.4g}."
        )
    for column in ("inner_radius_mm", "outer_radius_mm"):
        radius = used[column].median()
        if radius < 0.05:
            yield f"{column} looks like meters (median {radius:.4g}): in mm it would be {1000 * radius:.4g}."
        elif outer < 1 and not _vessel(used):
            in_mm = INCH_MM * radius
            yield f"{column} may be in inches (median {radius:.4g}): in mm it would be {in_mm:.4g}."


def _elongation(used: pd.DataFrame) -> Iterator[str]:
    size = used["elongation_mm"].abs()
    # Several levels: a bed that holds the length shows one small number, or none.
    held = flickers(used["elongation_mm"].to_numpy(np.float64), "elongation_mm")
    if 0 < size.max() < 0.03 and used["elongation_mm"].nunique() >= 3 and not held:
        yield UnitWarning(
            f"elongation_mm may be in meters (largest {size.max():.4g}, below what beds resolve in mm): "
            f"in mm it would be {1000 * size.max():.4g}.",
            "elongation_mm",
            1000.0,
        )


def _angles(used: pd.DataFrame) -> Iterator[str]:
    gamma = used["gamma_deg"].abs().max()
    if gamma < 90 * DEG:
        yield f"gamma_deg looks like radians (largest {gamma:.4g}): in degrees it would be {gamma / DEG:.4g}."


def _twist(used: pd.DataFrame) -> Iterator[str]:
    twist = used["twist_deg"].abs()
    held = flickers(used["twist_deg"].to_numpy(np.float64), "twist_deg")
    if 0 < twist.max() < LARGEST_TWIST_RAD and used["twist_deg"].nunique() >= 3 and not held:
        yield UnitWarning(
            f"twist_deg may be in radians (largest {twist.max():.4g}, at several different values): "
            f"in degrees it would be {twist.max() / DEG:.4g}.",
            "twist_deg",
            1 / DEG,
        )


def _pressure(used: pd.DataFrame) -> Iterator[str]:
    lowest, highest = used["pressure_kpa"].min(), used["pressure_kpa"].max()
    # Noise about zero goes as far down as up; a unit does not.
    if 0.2 < highest <= 1.2 and lowest > -0.1 * highest:
        says = f"pressure_kpa may be in bar (largest {highest:.4g}): in kPa it would be {100 * highest:.4g}."
        yield UnitWarning(says, "pressure_kpa", 100.0)
    elif 3 <= highest <= 12 and not _vessel(used):
        yield UnitWarning(
            f"pressure_kpa may be in psi (largest {highest:.4g}): in kPa it would be {PSI_KPA * highest:.4g} "
            "(10 psi = 69 kPa).",
            "pressure_kpa",
            PSI_KPA,
        )
    elif highest > 2000:
        in_kpa = highest / 1000
        says = f"pressure_kpa looks like pascals (largest {highest:.4g}): in kPa it would be {in_kpa:.4g}."
        yield UnitWarning(says, "pressure_kpa", 1e-3)
    if 95 < lowest < 107:
        yield (
            f"pressure_kpa may be absolute (lowest {lowest:.4g}, the atmosphere's): "
            f"as gauge pressure it would be {lowest - ATMOSPHERE_KPA:.2g}."
        )


def _moment(used: pd.DataFrame) -> Iterator[str]:
    force, moment = used["force_n"].abs().median(), used["moment_nmm"].abs().median()
    # An actuator that is hardly twisted may have next to no moment; else the ratio is of order 1 in N·mm.
    twisted = used["twist_deg"].abs().max() > 10
    if twisted and 0 < moment < 1e-2 * force * used["outer_radius_mm"].median():
        yield UnitWarning(
            f"moment_nmm may be in N·m (median size {moment:.3g} beside forces of {force:.3g} N): "
            f"in N·mm it would be {1000 * moment:.4g}.",
            "moment_nmm",
            1000.0,
        )


def _diameter(used: pd.DataFrame) -> Iterator[str]:
    largest, outer = used["outer_diameter_mm"].max(), 2 * used["outer_radius_mm"].median()
    for factor, unit in ((1e-3, "meters"), (1 / INCH_MM, "inches"), (1e3, "micrometers")):
        if 0.7 < largest / factor / outer < 3 and not 0.5 < largest / outer < 3:
            in_mm = largest / factor
            yield f"outer_diameter_mm may be in {unit} (largest {largest:.4g}): in mm it would be {in_mm:.4g}."
    if 0.35 < largest / outer < 0.6:
        yield (
            f"outer_diameter_mm may be a radius (largest {largest:.4g} beside an unloaded diameter of {outer:.4g}): "
            "give the diameter."
        )


def _vessel(used: pd.DataFrame) -> bool:
    """Whether all columns agree on a tube as short as it is wide, which low pressures swell: a vessel, not an actuator.

    A bed that measures no diameter has none. What is longer in inches than its own elongation lets it be is no vessel.
    """
    needed = ("length_mm", "outer_radius_mm", "outer_diameter_mm", "elongation_mm")
    if not set(needed) <= set(used):
        return False
    length, outer = used["length_mm"].median(), used["outer_radius_mm"].median()
    swollen = used["outer_diameter_mm"].max() / (2 * outer)
    strain = used["elongation_mm"] / used["length_mm"]
    stretched = strain.min() > LEAST_STRAIN and 0.01 < strain.abs().max() < LARGEST_STRAIN
    narrow = "pressure_kpa" in used and NARROWEST_MM < outer <= 1 and used["pressure_kpa"].max() <= NARROW_KPA
    return bool((narrow or 1 < outer < VESSEL_MM) and length > outer and 0.5 < swollen < 3 and stretched)


# What each check looks at: columns that all have to be there. It sees the table's other columns of numbers beside them.
CHECKS: dict[tuple[str, ...], Callable[[pd.DataFrame], Iterator[str]]] = {
    ("length_mm", "inner_radius_mm", "outer_radius_mm"): _lengths,
    ("elongation_mm",): _elongation,
    ("gamma_deg",): _angles,
    ("twist_deg",): _twist,
    ("pressure_kpa",): _pressure,
    ("force_n", "moment_nmm", "twist_deg", "outer_radius_mm"): _moment,
    ("pressure_kpa", "sample"): signs,
    ("outer_diameter_mm", "outer_radius_mm"): _diameter,
}
# What a force is compared with.
FORCE_NEEDS = ("force_n", "pressure_kpa", "inner_radius_mm", "outer_radius_mm", "length_mm", "elongation_mm")


def force_unit(used: pd.DataFrame) -> Iterator[str]:
    """A sentence where the forces that a bed measured are far too small or too large for its pressures."""
    largest, inner = used["force_n"].abs().max(), used["inner_radius_mm"].median()
    outer, strain = used["outer_radius_mm"].median(), (used["elongation_mm"] / used["length_mm"]).abs().max()
    thrust = math.pi * (MM * inner) ** 2 * KPA * used["pressure_kpa"].max()
    spring = math.pi * MM**2 * (outer**2 - inner**2) * WALL_PA * strain
    if 0 < largest < LEAST_OF_THRUST * thrust:
        yield UnitWarning(
            f"force_n may be in kN (largest {largest:.3g}, beside {thrust:.3g} N of pressure on the bore): "
            f"in N it would be {1000 * largest:.4g}.",
            "force_n",
            1000.0,
        )
    elif largest > MOST_OF_LOADS * (thrust + spring):
        yield UnitWarning(
            f"force_n may be in mN (largest {largest:.3g}, beside {thrust + spring:.3g} N of pressure on the bore and "
            f"stretched rubber): in N it would be {largest / 1000:.4g}.",
            "force_n",
            1e-3,
        )


def units_apart(warnings: Sequence[str]) -> tuple[list[str], list[str]]:
    """Those about units, and the others.

    >>> units_apart(["a blank column", UnitWarning("in psi")])
    (['in psi'], ['a blank column'])
    """
    return (
        [warning for warning in warnings if isinstance(warning, UnitWarning)],
        [warning for warning in warnings if not isinstance(warning, UnitWarning)],
    )


def unit_warnings(table: pd.DataFrame) -> list[str]:
    """A sentence for each suspicion about a checked measurement table, with the value after conversion: a UnitWarning
    where it is about a unit.

    Suspicions only: nothing is converted, and an unusual actuator may be right as it is.
    """
    used = used_rows(table)
    # A bed need not have every column; one that it does not know stays text.
    numbers = used.select_dtypes("number").dropna(axis=1, how="all")
    found = [warning for needs, check in CHECKS.items() if set(needs) <= set(numbers) for warning in check(numbers)]
    # Beside a column that is suspected itself, the force tells nothing.
    if FORCE in bed_of(used).measured and set(FORCE_NEEDS) <= set(numbers) and not _about(found, FORCE_NEEDS):
        found += force_unit(numbers)
    return [*map(_told, found), *([] if is_log(used) else _step(used))]


def _told(said: str) -> UnitWarning:
    return said if isinstance(said, UnitWarning) else UnitWarning(said)


def _about(sentences: Sequence[str], columns: Sequence[str]) -> bool:
    return any(sentence.startswith(f"{column} ") for sentence in sentences for column in columns)


# Share of the rows in which the bed stands while the pressure changes, above which steps are to be counted: in sweeps
# of the length under one pressure after the other it stands where one ends and the next begins.
STANDS = 0.25


def _stands(used: pd.DataFrame, state: list[str]) -> bool:
    same = stood(used, ["sample", *state])
    return bool((same & (np.diff(used["pressure_kpa"].to_numpy(np.float64)) != 0)).sum() > STANDS * len(used))


def _step(used: pd.DataFrame) -> Iterator[str]:
    state = [quantity.column for quantity in bed_of(used).state]
    states = used.groupby(["sample", *state], sort=False)
    # Several visits of one place, each with a step of its own, count nowhere either.
    if (states["step"].nunique() > 1).any():
        return
    pressures = states["pressure_kpa"].nunique()
    if (pressures > 1).any() and _stands(used, state):
        same = used["step"].iloc[0] if used["step"].nunique() == 1 else None
        yield (
            f"step {'never changes' if same is None else f'is {same} in every row'} although a kinematic state has up "
            f"to {pressures.max()} pressures: count 0, 1, … in time within each state, so that rising and falling "
            "pressure can be told apart."
        )
