"""Warnings about columns whose numbers suggest another unit than their names say."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import pandas as pd

from freelearn.measurements.beds import bed_of
from freelearn.measurements.usable import usable_rows
from freelearn.units import DEG

INCH_MM = 25.4
PSI_KPA = 6.894757
ATMOSPHERE_KPA = 101.3
# The largest twist of a bed, ±120°, is 2.1 rad.
LARGEST_TWIST_RAD = 2.2


class UnitWarning(str):
    """A suspicion that a column is in another unit: what is computed from it means nothing until somebody looks."""


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
    used = table[usable_rows(table)]
    # A bed need not have every column; one that it does not know stays text.
    numbers = used.select_dtypes("number").dropna(axis=1, how="all")
    found = [warning for needs, check in CHECKS.items() if set(needs) <= set(numbers) for warning in check(numbers)]
    return [*map(UnitWarning, found), *_step(used)]


def _lengths(used: pd.DataFrame) -> Iterator[str]:
    length, outer = used["length_mm"].median(), used["outer_radius_mm"].median()
    if length < 1:
        yield f"length_mm looks like meters (median {length:.4g}): in mm it would be {1000 * length:.4g}."
    elif length < 20 and (outer < 1 or outer > length / 4):
        yield (
            f"length_mm may be in inches or centimeters (median {length:.4g}, short for an actuator): "
            f"in mm it would be {INCH_MM * length:.4g} or {10 * length:.4g}."
        )
    for column in ("inner_radius_mm", "outer_radius_mm"):
        radius = used[column].median()
        if radius < 0.05:
            yield f"{column} looks like meters (median {radius:.4g}): in mm it would be {1000 * radius:.4g}."
        elif outer < 1:
            in_mm = INCH_MM * radius
            yield f"{column} may be in inches (median {radius:.4g}): in mm it would be {in_mm:.4g}."


def _elongation(used: pd.DataFrame) -> Iterator[str]:
    size = used["elongation_mm"].abs()
    # Several levels: a bed that holds the length shows one small number, or none.
    if 0 < size.max() < 0.03 and used["elongation_mm"].nunique() >= 3:
        yield (
            f"elongation_mm may be in meters (largest {size.max():.4g}, below what beds resolve in mm): "
            f"in mm it would be {1000 * size.max():.4g}."
        )


def _angles(used: pd.DataFrame) -> Iterator[str]:
    gamma = used["gamma_deg"].abs().max()
    if gamma < 90 * DEG:
        yield f"gamma_deg looks like radians (largest {gamma:.4g}): in degrees it would be {gamma / DEG:.4g}."


def _twist(used: pd.DataFrame) -> Iterator[str]:
    twist = used["twist_deg"].abs()
    if 0 < twist.max() < LARGEST_TWIST_RAD and used["twist_deg"].nunique() >= 3:
        yield (
            f"twist_deg may be in radians (largest {twist.max():.4g}, at several different values): "
            f"in degrees it would be {twist.max() / DEG:.4g}."
        )


def _pressure(used: pd.DataFrame) -> Iterator[str]:
    lowest, highest = used["pressure_kpa"].min(), used["pressure_kpa"].max()
    # Noise about zero goes as far down as up; a unit does not.
    if 0.2 < highest <= 1.2 and lowest > -0.1 * highest:
        yield f"pressure_kpa may be in bar (largest {highest:.4g}): in kPa it would be {100 * highest:.4g}."
    elif 3 <= highest <= 12:
        yield (
            f"pressure_kpa may be in psi (largest {highest:.4g}): in kPa it would be {PSI_KPA * highest:.4g} "
            "(10 psi = 69 kPa)."
        )
    elif highest > 2000:
        in_kpa = highest / 1000
        yield f"pressure_kpa looks like pascals (largest {highest:.4g}): in kPa it would be {in_kpa:.4g}."
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
        yield (
            f"moment_nmm may be in N·m (median size {moment:.3g} beside forces of {force:.3g} N): "
            f"in N·mm it would be {1000 * moment:.4g}."
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


def _step(used: pd.DataFrame) -> Iterator[str]:
    if (used["step"] == 0).all():
        state = [quantity.column for quantity in bed_of(used).state]
        states = used.groupby(["sample", *state], sort=False)
        pressures = states["pressure_kpa"].nunique()
        if (pressures > 1).any():
            yield (
                f"step is 0 in every row although a kinematic state has up to {pressures.max()} pressures: "
                "count 0, 1, … in time within each state, so that rising and falling pressure can be told apart."
            )


# What each check looks at: columns that all have to be there.
CHECKS: dict[tuple[str, ...], Callable[[pd.DataFrame], Iterator[str]]] = {
    ("length_mm", "inner_radius_mm", "outer_radius_mm"): _lengths,
    ("elongation_mm",): _elongation,
    ("gamma_deg",): _angles,
    ("twist_deg",): _twist,
    ("pressure_kpa",): _pressure,
    ("force_n", "moment_nmm", "twist_deg", "outer_radius_mm"): _moment,
    ("outer_diameter_mm", "outer_radius_mm"): _diameter,
}
