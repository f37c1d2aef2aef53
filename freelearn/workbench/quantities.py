"""What a column of a laboratory's file can be, and in which units."""

from __future__ import annotations

from freelearn.measurements.columns import MARKS

# Marks of 1 in a column, as the page calls them.
MARK_OF = {mark.replace("_", " "): mark for mark in MARKS}
# What a column can be → its kind of unit. Those that intake's table has only after a conversion stand in DERIVED.
QUANTITIES = {
    "not used": "",
    "sample": "",
    "elongation": "length",
    "held length": "length",
    "stretch": "ratio",
    "strain": "ratio",
    "contraction": "ratio",
    "twist": "angle",
    "pressure": "pressure",
    "force": "force",
    "moment": "moment",
    "outer diameter": "length",
    "time": "time",
    "temperature": "temperature",
    "fiber angle": "angle",
    "angle of a second family": "angle",
    "unloaded length": "length",
    "inner radius": "length",
    "outer radius": "length",
    "step": "",
    **dict.fromkeys(MARK_OF, ""),
}
# The table's own unit first.
UNITS = {
    "length": ("mm", "cm", "m", "µm", "in"),
    "ratio": ("1", "%"),
    "angle": ("deg", "rad", "turn"),
    "pressure": ("kPa", "Pa", "MPa", "bar", "mbar", "psi", "mmHg"),
    "force": ("N", "mN", "kN", "lbf", "gf", "kgf", "ozf"),
    "moment": ("N·mm", "N·m", "mN·m", "N·cm", "lbf·in", "lbf·ft", "ozf·in"),
    "time": ("s", "ms", "min", "h"),
    "temperature": ("°C", "K", "°F"),
}
COLUMNS = {
    "elongation": "elongation_mm",
    "twist": "twist_deg",
    "pressure": "pressure_kpa",
    "force": "force_n",
    "moment": "moment_nmm",
    "outer diameter": "outer_diameter_mm",
    "time": "time_s",
    "temperature": "temperature_c",
    "fiber angle": "gamma_deg",
    "angle of a second family": "gamma2_deg",
    "unloaded length": "length_mm",
    "inner radius": "inner_radius_mm",
    "outer radius": "outer_radius_mm",
}
# Further keys of a column of elongations.
DERIVED = {
    "held length": ("minus: length_mm",),
    "stretch": ("times: length_mm", "minus: length_mm"),
    "strain": ("times: length_mm",),
    "contraction": ("times: length_mm",),
}


def table_column(quantity: str) -> str:
    """The column of the table that a quantity becomes; "" for none.

    >>> table_column("stretch"), table_column("not used")
    ('elongation_mm', '')
    """
    return "elongation_mm" if quantity in DERIVED else COLUMNS.get(quantity, "")
