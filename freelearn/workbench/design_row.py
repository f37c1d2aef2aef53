"""What no column of a laboratory's file says, because it is the same in all rows."""

from __future__ import annotations

from collections.abc import Sequence

import panel as pn

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.recipe import NEEDED_DESIGN
from freelearn.workbench.mapped import MappedColumn
from freelearn.workbench.quantities import table_column

DESIGN = {
    "gamma_deg": "fiber angle to the axis [°]",
    "gamma2_deg": "second family [°], if any",
    "length_mm": "unloaded length [mm]",
    "inner_radius_mm": "inner radius [mm]",
    "outer_radius_mm": "outer radius [mm]",
}
HOLD = "0 if it was held at 0"
ANGLES = "fiber angles of the actuators [°], in the order of their pressures"


class DesignRow:
    """A number for each part of the design, and for what the bed held."""

    def __init__(self) -> None:
        imposed = {q.column: q for bed in BEDS.values() for q in bed.imposed}
        names = DESIGN | {name: f"{q.name} [{q.unit}], held" for name, q in imposed.items()}
        self.numbers = {
            name: pn.widgets.FloatInput(name=text, value=None, width=220, placeholder="" if name in DESIGN else HOLD)
            for name, text in names.items()
        }
        self.each = pn.widgets.TextInput(name=ANGLES, placeholder="40, -40", width=452, visible=False)
        self.view = pn.FlexBox(*self.numbers.values(), self.each)

    def offer(self, bed: str, columns: Sequence[MappedColumn]) -> None:
        """Asks for what these columns do not say and a table of the bed needs."""
        said = {table_column(column.quantity) for column in columns}
        several = sum(column.quantity == "pressure" for column in columns) > 1
        wanted = {*DESIGN, *(quantity.column for quantity in BEDS[bed].imposed)} - said
        if several:
            wanted -= {"gamma_deg"}
        self.each.visible = several
        for name, widget in self.numbers.items():
            widget.visible = name in wanted

    def constants(self) -> dict[str, float]:
        """The numbers that were given, by the column of the table. Raises UserError where one is lacking."""
        shown = {name: widget.value for name, widget in self.numbers.items() if widget.visible}
        lacking = [self.numbers[name].name for name in NEEDED_DESIGN if name in shown and shown[name] is None]
        if lacking:
            raise UserError(f"A table needs the whole design: give the {', the '.join(lacking)}, here or as a column.")
        held = [self.numbers[name].name for name in shown if name not in DESIGN and shown[name] is None]
        if held:
            raise UserError(
                f"No column is the {', nor the '.join(held)}: choose its column, or give the number ({HOLD})."
            )
        return {name: float(value) for name, value in shown.items() if value is not None}

    def angles(self) -> list[float]:
        """The fiber angles of several actuators. Raises UserError."""
        if not self.each.visible:
            return []
        try:
            return [
                float(part.replace("−", "-"))
                for part in str(self.each.value).replace(";", ",").split(",")
                if part.strip()
            ]
        except ValueError:
            raise UserError(f"{ANGLES}: give numbers with commas between them, such as 40, -40.") from None
