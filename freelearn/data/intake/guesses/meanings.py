"""What a column of a laboratory's file can be: quantities of the table, and those that become one by a conversion."""

from __future__ import annotations

from dataclasses import dataclass

from freelearn.data.intake.headings import INNER_DIAMETER, RUN

# A length that was held: the table's own is the unloaded one.
HELD = "held_length"
# An outer diameter that is the same in all rows of an actuator is its design, and no reading.
OUTER_DIAMETER = "outer_diameter"
NOT_USED = "not used"


@dataclass(frozen=True)
class Meaning:
    """words: as people call it. kind: of its unit, "" for none. column: of the table. keys: of the recipe, besides."""

    words: str
    kind: str
    column: str
    keys: tuple[tuple[str, str | float], ...] = ()


OF_THE_LENGTH = (("times", "length_mm"),)
MEANINGS = {
    "sample": Meaning("sample", "", "sample"),
    "elongation_mm": Meaning("elongation", "length", "elongation_mm"),
    HELD: Meaning("held length", "length", "elongation_mm", (("minus", "length_mm"),)),
    "stretch": Meaning("stretch", "ratio", "elongation_mm", (*OF_THE_LENGTH, ("minus", "length_mm"))),
    "strain": Meaning("strain", "ratio", "elongation_mm", OF_THE_LENGTH),
    "contraction": Meaning("contraction", "ratio", "elongation_mm", (*OF_THE_LENGTH, ("sign", -1))),
    "shortening": Meaning("shortening", "length", "elongation_mm", (("sign", -1),)),
    "twist_deg": Meaning("twist", "angle", "twist_deg"),
    "pressure_kpa": Meaning("pressure", "pressure", "pressure_kpa"),
    "force_n": Meaning("force", "force", "force_n"),
    "moment_nmm": Meaning("moment", "moment", "moment_nmm"),
    "outer_diameter_mm": Meaning("outer diameter", "length", "outer_diameter_mm"),
    "time_s": Meaning("time", "time", "time_s"),
    "temperature_c": Meaning("temperature", "temperature", "temperature_c"),
    "gamma_deg": Meaning("fiber angle", "angle", "gamma_deg"),
    "gamma2_deg": Meaning("angle of a second family", "angle", "gamma2_deg"),
    "length_mm": Meaning("unloaded length", "length", "length_mm"),
    "inner_radius_mm": Meaning("inner radius", "length", "inner_radius_mm"),
    INNER_DIAMETER: Meaning("inner diameter", "length", "inner_radius_mm", (("scale", 0.5),)),
    "outer_radius_mm": Meaning("outer radius", "length", "outer_radius_mm"),
    OUTER_DIAMETER: Meaning("outer diameter, unloaded", "length", "outer_radius_mm", (("scale", 0.5),)),
    RUN: Meaning("recording", "", "run"),
    "step": Meaning("step", "", "step"),
    "buckled": Meaning("buckled", "", "buckled"),
    "slack": Meaning("slack", "", "slack"),
    "left_out": Meaning("left out", "", "left_out"),
}
# The table's own unit first.
UNITS = {
    "length": ("mm", "cm", "m", "µm", "in"),
    "ratio": ("1", "%"),
    "angle": ("deg", "rad", "turn"),
    "pressure": ("kPa", "Pa", "MPa", "bar", "mbar", "psi", "mmHg"),
    "force": ("N", "mN", "kN", "lbf", "gf", "kgf", "ozf"),
    "moment": ("N·mm", "N·m", "mN·m", "N·cm", "lbf·in", "lbf·ft", "ozf·in"),
    "time": ("s", "ms", "µs", "ns", "min", "h", "day"),
    "temperature": ("°C", "K", "°F"),
}


def column_of(quantity: str | None) -> str:
    """The column of the table that a quantity becomes; "" for none.

    >>> column_of("stretch"), column_of(None)
    ('elongation_mm', '')
    """
    return MEANINGS[quantity].column if quantity in MEANINGS else ""
