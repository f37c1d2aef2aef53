"""An empty measurement table to fill in."""

from __future__ import annotations

from freelearn.data.beds import BEDS
from freelearn.data.columns import pressure_columns
from freelearn.data.intake.recipes.recipe import NEEDED_DESIGN

EXAMPLE = {
    "sample": "1",
    "gamma_deg": "40",
    "length_mm": "90.5",
    "inner_radius_mm": "4.77",
    "outer_radius_mm": "6.35",
    "step": "0",
    "elongation_mm": "0",
    "twist_deg": "0",
    "force_n": "-1.25",
    "moment_nmm": "-10.5",
    "outer_diameter_mm": "12.9",
    "buckled": "0",
}
# Readings of a bed that imposes the loads: a free end.
FREE = {"force_n": "0", "moment_nmm": "0", "elongation_mm": "-0.8", "twist_deg": "-12.5"}


def template(bed: str, members: int = 0) -> str:
    """The header and one row as an example, CSV. bed: a name of BEDS. members: of an assembly, 0 for one actuator.

    >>> template("isometric").splitlines()[0].split(",")[-2:]
    ['force_n', 'buckled']
    """
    chosen = BEDS[bed]
    pressures = pressure_columns(range(1, members + 1))
    used = [quantity.column for quantity in (*chosen.imposed, *chosen.measured)]
    names = ["sample", *([] if members else NEEDED_DESIGN), "step"]
    for name in ("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm", "outer_diameter_mm"):
        if name in used:
            names += pressures if name == "pressure_kpa" else [name]
    names.append("buckled")
    values = {**EXAMPLE, **dict.fromkeys(pressures, "30"), **(FREE if bed == "dead_load" else {})}
    return ",".join(names) + "\n" + ",".join(values[name] for name in names) + "\n"


def members_template(members: int) -> str:
    """The file of an assembly's members, CSV."""
    row = "40,,90.5,4.77,6.35"
    rows = [f"{number},{row}" for number in range(1, members + 1)]
    return "\n".join(["member,gamma_deg,gamma2_deg,length_mm,inner_radius_mm,outer_radius_mm", *rows]) + "\n"
