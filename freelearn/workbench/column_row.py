"""One column of a laboratory's file on the page: an example, and what it is."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import panel as pn
from markupsafe import escape

from freelearn.measurements.intake.guess import HELD
from freelearn.measurements.intake.units import conversion, dimension
from freelearn.workbench.mapped import MappedColumn
from freelearn.workbench.quantities import COLUMNS, MARK_OF, QUANTITIES, UNITS
from freelearn.workbench.words import HIDDEN_LABEL, STYLE

# What a guess calls a quantity → what the page does.
CALLED = {
    **{column: quantity for quantity, column in COLUMNS.items()},
    **{mark: name for name, mark in MARK_OF.items()},
    HELD: "held length",
}
PRESSURE_OF_ONE = re.compile(r"pressure_\d+_kpa")


class ColumnRow:
    """guess: an entry of guess.json. pressures: names of the columns that are pressures of several actuators. changed:
    called when another quantity is chosen."""

    def __init__(self, guess: dict[str, Any], pressures: Sequence[str], changed: Callable[[], None]) -> None:
        self.guess, name = guess, guess["name"]
        self.about = pn.pane.HTML(_about(guess), stylesheets=[STYLE], width=330, margin=(4, 10))
        hidden = {"stylesheets": [HIDDEN_LABEL]}
        self.quantity = pn.widgets.Select(
            name=f"what {name} is", options=list(QUANTITIES), value=_quantity(guess, pressures), width=170, **hidden
        )
        self.unit = pn.widgets.Select(name=f"unit of {name}", options=[], width=100, **hidden)
        signs = {"as it is": False, "turned": True}
        self.turned = pn.widgets.Select(name=f"sign of {name}", options=signs, value=False, width=100, **hidden)
        self.offset = pn.widgets.FloatInput(name=f"offset of {name}", value=0.0, width=130, **hidden)
        self.quantity.param.watch(lambda _: self._chosen(changed), "value")
        self._units()

    @property
    def cells(self) -> list[Any]:
        """What stands in the row."""
        return [self.about, self.quantity, self.unit, self.turned, self.offset]

    @property
    def mapped(self) -> MappedColumn:
        """What the row says."""
        words = tuple(self.guess["words"]) if self.quantity.value == "sample" else ()
        return MappedColumn(
            self.guess["name"], self.quantity.value, self.unit.value or "", self.turned.value,
            float(self.offset.value or 0.0), words,
        )  # fmt: skip

    def _chosen(self, changed: Callable[[], None]) -> None:
        self._units()
        changed()

    def _units(self) -> None:
        kind = QUANTITIES[self.quantity.value]
        options, written = list(UNITS.get(kind, ())), self.guess["unit"]
        value = options[0] if options else None
        if kind and written and dimension(written) == kind:
            value = next((option for option in options if _same(written, option)), written)
            options += [] if value in options else [written]
        self.unit.param.update(options=options, value=value)
        for cell in (self.unit, self.turned, self.offset):
            cell.disabled = not kind


def _same(written: str, unit: str) -> bool:
    """Whether two spellings are one unit."""
    change = conversion(written, unit)
    return abs(change.factor - 1) < 1e-9 and abs(change.shift) < 1e-9


def _quantity(guess: dict[str, Any], pressures: Sequence[str]) -> str:
    name = guess["name"]
    if name in pressures or PRESSURE_OF_ONE.fullmatch(name):
        return "pressure"
    if not guess["chosen"]:
        return "not used"
    said = guess["quantity"]
    return CALLED.get(said, said if said in QUANTITIES else "not used")


def _about(guess: dict[str, Any]) -> str:
    """The column's name with its range or words, and what is not sure. Everything from the file is escaped."""
    if guess["low"] is None:
        shown = ", ".join(guess["words"][:4]) or guess["example"] or "blank"
    else:
        shown = f"{guess['low']:.4g} … {guess['high']:.4g}, first {_short(guess['example'])}"
    doubts = []
    if guess["chosen"] and QUANTITIES.get(CALLED.get(guess["quantity"], guess["quantity"]), "") not in ("", "ratio"):
        doubts += [] if guess["unit"] else ["the heading says no unit"]
    if guess["chosen"] and guess["confidence"] != "sure":
        doubts.append(f"{guess['confidence']}: check")
    doubt = f'<span class="bad"> {escape("; ".join(doubts))}</span>' if doubts else ""
    return f'<p><b>{escape(guess["name"])}</b>{doubt}<br><span class="quiet">{escape(shown[:60])}</span></p>'


def _short(example: str) -> str:
    """A number with as many digits as one looks at; one with a decimal comma, say, as it is written."""
    try:
        return f"{float(example):.6g}"
    except ValueError:
        return example
