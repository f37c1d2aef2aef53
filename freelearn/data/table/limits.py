"""What the design of an actuator must be, and values that no bed can have: faults of a table, and not suspicions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from freelearn.data.columns import SECOND, members_in
from freelearn.data.table.faults import Rule


def design_rules() -> tuple[Rule, ...]:
    """The rules for the columns of the design, in a measurement table and in one of members."""
    return (
        *map(_angle, ("gamma_deg", SECOND)),
        Rule(
            "length_mm",
            ("length_mm",),
            lambda t: t["length_mm"] <= 0,
            "is not positive: give the unloaded length",
        ),
        Rule(
            "inner_radius_mm",
            ("inner_radius_mm",),
            lambda t: t["inner_radius_mm"] <= 0,
            "is not positive: give the unloaded inner radius",
        ),
        Rule(
            "outer_radius_mm",
            ("outer_radius_mm", "inner_radius_mm"),
            lambda t: t["outer_radius_mm"] <= t["inner_radius_mm"],
            "is not above inner_radius_mm: look whether the two are swapped, or one is a diameter",
        ),
    )


def _angle(column: str) -> Rule:
    return Rule(
        column,
        (column,),
        lambda t: (t[column] == 0) | (t[column].abs() >= 90),
        "is 0, or outside −90 … 90: give the fiber angle to the axis in degrees, negative for a helix the other way",
    )


# Values that no bed can have, whatever the actuator: faults of a table, and not suspicions.
#
# Far beyond what anybody builds, so that a column in another unit is still read, and suspected of that.


@dataclass(frozen=True)
class Limits:
    """least, most: size of a value in the column's unit, zero apart. why: what lies beyond."""

    least: float
    most: float
    why: str


# A micrometer to a kilometer; the mount of 100,000 tons; the pressure in a planet.
LENGTH = Limits(1e-3, 1e6, "no tube is so short or so long: give millimeters")
RADIUS = Limits(1e-4, 1e5, "no tube is so thin or so wide: give millimeters")
ANGLE = Limits(1e-3, 90.0, "no fiber can be wound so: give the angle to the axis in degrees")
LIMITS = {
    "gamma_deg": ANGLE,
    SECOND: ANGLE,
    "length_mm": LENGTH,
    "inner_radius_mm": RADIUS,
    "outer_radius_mm": RADIUS,
    "elongation_mm": Limits(0, 1e6, "no bed moves so far: give millimeters"),
    "twist_deg": Limits(0, 1e6, "no bed turns so far: give degrees"),
    "pressure_kpa": Limits(0, 1e7, "no wall holds so much: give kilopascals"),
    "force_n": Limits(0, 1e9, "no bed measures so much: give newtons"),
    "moment_nmm": Limits(0, 1e12, "no bed measures so much: give newton millimeters"),
    "outer_diameter_mm": Limits(1e-3, 1e6, "no tube is so thin or so wide: give millimeters"),
    "time_s": Limits(0, 1e11, "no test lasts so long: give seconds"),
    "temperature_c": Limits(0, 1e4, "no actuator bears it: give degrees Celsius"),
}
# Length over unloaded length that no wall survives.
LEAST_STRETCH, MOST_STRETCH = 1e-3, 1e3
# A wall thinner than this share of its radius is rounding.
LEAST_WALL = 1e-6
# All readings of a column together are no reading where the largest is less [in its unit]: of rounding, or of a unit.
LEAST_READING = 1e-12
READ = ("elongation_mm", "twist_deg", "force_n", "moment_nmm", "outer_diameter_mm")


def limit_rules(columns: Sequence[str], measured: Sequence[str] = ()) -> list[Rule]:
    """The rules for the columns of these names. measured: those that hold readings."""
    rules = [_beyond(name, limits) for name in columns if (limits := _limits(name, columns))]
    rules += [_all_tiny(name) for name in measured if name in READ]
    return [*rules, _stretch(), _wall()]


def _limits(name: str, columns: Sequence[str]) -> Limits | None:
    pressures = {f"pressure_{number}_kpa" for number in members_in(columns)}
    return LIMITS.get("pressure_kpa" if name in pressures else name)


def _beyond(name: str, limits: Limits) -> Rule:
    def beyond(table: pd.DataFrame) -> pd.Series:
        size = table[name].abs()
        return (size > limits.most) | ((size < limits.least) & (size > 0))

    return Rule(name, (name,), beyond, f"is beyond {_range(limits)}: {limits.why}")


def _range(limits: Limits) -> str:
    return f"±{limits.most:g}" if not limits.least else f"{limits.least:g} … {limits.most:g}"


def _all_tiny(name: str) -> Rule:
    def tiny(table: pd.DataFrame) -> pd.Series:
        size = table[name].abs()
        return (size > 0) & (size.max() < LEAST_READING)

    return Rule(
        name,
        (name,),
        tiny,
        f"is no reading, nor is any other of the column, of which the largest is below {LEAST_READING:g}: look at the "
        "column's unit, or write 0",
    )


def _stretch() -> Rule:
    def torn(table: pd.DataFrame) -> pd.Series:
        stretch = 1 + table["elongation_mm"] / table["length_mm"]
        return (table["length_mm"] > 0) & ((stretch < LEAST_STRETCH) | (stretch > MOST_STRETCH))

    return Rule(
        "elongation_mm",
        ("elongation_mm", "length_mm"),
        torn,
        "leaves no length, or a thousand times it: give the change from length_mm, negative when shorter",
    )


def _wall() -> Rule:
    return Rule(
        "outer_radius_mm",
        ("outer_radius_mm", "inner_radius_mm"),
        lambda t: t["outer_radius_mm"] - t["inner_radius_mm"] < LEAST_WALL * t["outer_radius_mm"],
        "leaves no wall around inner_radius_mm: give both with enough digits",
    )
