"""The columns of a measurement table, by bed and by the number of actuators on one end block."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from freelearn.measurements.beds import KINEMATIC, Bed, bed_of
from freelearn.measurements.members import DESIGN, SECOND, members_in, pressure_column
from freelearn.measurements.usable import LEFT_OUT, SLACK

# Marks of 0 or 1; a blank one marks nothing, but for that of buckling.
MARKS = ("buckled", LEFT_OUT, SLACK)
INTEGERS = ("sample", "step", *MARKS)
OPTIONAL = ("time_s", "temperature_c", LEFT_OUT, SLACK)


@dataclass(frozen=True)
class Columns:
    """What the columns of a table are, of a bed and of one actuator (members 0) or several on one end block.

    required: must be there, and hold a number in every row. measured: may be blank or absent, but not all of them.
    blank: optional, and may be blank. optional: may be absent."""

    bed: Bed = KINEMATIC
    members: int = 0

    @classmethod
    def of(cls, table: pd.DataFrame) -> Columns:
        """Of a table in the program."""
        return cls(bed_of(table), len(members_in(table.columns)))

    @property
    def pressures(self) -> tuple[str, ...]:
        """The imposed pressures."""
        return tuple(pressure_column(i + 1) for i in range(self.members)) or ("pressure_kpa",)

    @property
    def imposed(self) -> tuple[str, ...]:
        """What the bed imposes: its two quantities, and the pressures."""
        return (*(quantity.column for quantity in self.bed.state), *self.pressures)

    @property
    def state(self) -> tuple[str, ...]:
        """What tells one row of a sample from another."""
        return (*(quantity.column for quantity in self.bed.state), "step", *self.pressures)

    @property
    def required(self) -> tuple[str, ...]:
        """Columns that must be there, in the order of the contract."""
        design = () if self.members else DESIGN
        first, second = (quantity.column for quantity in self.bed.state)
        return ("sample", *design, "step", first, second, *self.pressures, "buckled")

    @property
    def measured(self) -> tuple[str, ...]:
        """Columns of what the bed measures."""
        return tuple(quantity.column for quantity in self.bed.measured)

    @property
    def blank(self) -> tuple[str, ...]:
        """Optional columns of which cells may be blank."""
        return () if self.members else (SECOND,)

    @property
    def known(self) -> tuple[str, ...]:
        """Every column that means something."""
        return (*self.required, *self.measured, *self.blank, *OPTIONAL)

    @property
    def listed(self) -> tuple[str, ...]:
        """The columns of a whole table, in the order of the contract."""
        return (*self.required[:-1], *self.measured, "buckled")
