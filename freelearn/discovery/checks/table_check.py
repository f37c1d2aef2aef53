"""One check of a table; and lengths, radii, walls and angles that no actuator has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

import pandas as pd

from freelearn.data.columns import SECOND, Columns, design_column, members_in

Status = Literal["pass", "fail", "cannot_tell"]
PASS: Status = "pass"
FAIL: Status = "fail"
CANNOT: Status = "cannot_tell"


@dataclass(frozen=True)
class TableCheck:
    """name: of what was looked at. figure beside threshold: a failed check's is on the wrong side; None where there is
    no number. says: one sentence: what, where, and what to do. cure: as options of the command, where there are such.
    """

    name: str
    status: Status
    figure: float | None
    threshold: float | None
    says: str
    cure: str = ""

    @property
    def sentence(self) -> str:
        """What it says, and the option that would mend it."""
        return f"{self.says} Try {self.cure}." if self.cure else self.says

    def plain(self) -> dict[str, Any]:
        """As discovery.json holds it."""
        return asdict(self)


# Lengths, radii, walls and angles that no actuator has.

NAME = "an actuator's size"
# From a vessel of a mouse to an arm of a building machine [mm]; thickness as a share of the outer radius; angle from
# the axis [deg]; slenderness L / R_o; longest and shortest length as a share of that at rest.
LENGTH, RADIUS, WALL, ANGLE = (2.0, 5000.0), (0.2, 200.0), (0.01, 0.9), (1.5, 89.0)
SLENDER, STRETCH = (0.5, 250.0), (0.35, 3.0)
# Highest pressure of a table that inflates something [kPa].
LEAST_KPA = 0.5
# Twist of a length of one radius [deg].
TURN = 200.0


def actuator(table: pd.DataFrame) -> TableCheck:
    """Whether the design, and how far it is stretched and twisted, is one that there is."""
    found = list(dict.fromkeys(_odd(table)))
    pressure = max(float(table[name].max()) for name in Columns.from_table(table).pressures)
    if not found and _next_to_nothing(table, pressure):
        says = f"The pressure is {pressure:.3g} kPa at most, which inflates nothing: it may be in bar or in MPa."
        return TableCheck(NAME, FAIL, pressure, LEAST_KPA, says)
    if not found:
        return TableCheck(NAME, PASS, None, None, "Length, radii, wall and angle are those of an actuator.")
    return TableCheck(NAME, FAIL, None, None, f"{'; '.join(found)}: no actuator is like that; correct the column.")


def _next_to_nothing(table: pd.DataFrame, highest: float) -> bool:
    """Whether what was meant for a pressure is too little for one: several levels, and no noise about zero."""
    if not 0 < highest < LEAST_KPA:
        return False
    values = pd.concat([table[name] for name in Columns.from_table(table).pressures])
    return bool(values.min() > -0.2 * highest and (values / highest * 10).round().nunique() >= 4)


def _odd(table: pd.DataFrame) -> Iterator[str]:
    for number in members_in(table.columns) or [0]:

        def of(name: str, number: int = number) -> pd.Series:
            return table[design_column(name, number) if number else name]

        length, inner, outer = of("length_mm"), of("inner_radius_mm"), of("outer_radius_mm")
        yield from _outside("length_mm", length, LENGTH)
        yield from _outside("outer_radius_mm", outer, RADIUS)
        yield from _outside("wall / outer radius", 1 - inner / outer, WALL)
        yield from _outside("length / outer radius", length / outer, SLENDER)
        second = design_column(SECOND, number) if number else SECOND
        for angle in ("gamma_deg", second):
            values = table[angle] if angle in table and angle != "gamma_deg" else of("gamma_deg")
            yield from _outside("the fiber angle", values.dropna().abs(), ANGLE)
        if "elongation_mm" in table:
            yield from _outside(
                "stretched length / length at rest", 1 + (table["elongation_mm"] / length).dropna(), STRETCH
            )
        if "twist_deg" in table:
            yield from _outside(
                "twist of a length of one radius", (table["twist_deg"] * outer / length).dropna(), (-TURN, TURN)
            )


def _outside(name: str, values: pd.Series, allowed: tuple[float, float]) -> Iterator[str]:
    for value in (values.min(), values.max()) if len(values) else ():
        if not allowed[0] <= value <= allowed[1]:
            yield f"{name} is {value:.4g}"
