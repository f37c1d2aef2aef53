"""What the design of an actuator must be."""

from __future__ import annotations

from freelearn.measurements.faults import Rule
from freelearn.measurements.members import SECOND


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
