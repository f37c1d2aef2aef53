"""How well the user's bed measures."""

from __future__ import annotations

from typing import Any

import panel as pn

from freelearn.measurements.accuracy import PAPER
from freelearn.measurements.beds import BEDS, Quantity
from freelearn.workbench.part import Part
from freelearn.workbench.question import OWN, Stated
from freelearn.workbench.session import Session

USUAL, ESTIMATE, STATE = "as the paper's bed", "estimate it from the data", "state it"
QUANTITIES = {q.column: q for bed in BEDS.values() for q in (*bed.imposed, *bed.measured)}
# What may be exact: all but the readings of a load cell or a camera.
MAY_BE_EXACT = ("elongation_mm", "twist_deg", "pressure_kpa")
SMALLEST = 1e-9


class AccuracyChoice(Part):
    """An estimate, the paper's, or one standard deviation of each quantity of the bed."""

    def __init__(self, session: Session, width: int) -> None:
        super().__init__(session)
        options = [ESTIMATE, USUAL, STATE]
        self.how = pn.widgets.Select(name="accuracy of the measuring", options=options, width=width)
        self.numbers = {name: _number(quantity, width) for name, quantity in QUANTITIES.items()}
        self.how.param.watch(lambda _: self._chosen(), "value")
        for widget in self.numbers.values():
            widget.param.watch(lambda _: self._chosen(), "value")
        self.view = pn.Column(self.how, *self.numbers.values())

    def _chosen(self) -> None:
        if not self.refreshing:
            self.session.choose(accuracy=self._stated())

    def _stated(self) -> Stated:
        if self.how.value == ESTIMATE:
            return None
        if self.how.value == USUAL:
            return ()
        shown = _of_bed(self.session.question.bed)
        given = {name: widget.value for name, widget in self.numbers.items() if name in shown}
        return tuple((name, float(value)) for name, value in given.items() if value is not None)

    def refresh(self) -> None:
        """Shows the session as it is."""
        question, busy = self.session.question, self.session.busy
        stated = question.accuracy
        shown = _of_bed(question.bed) if stated else set()
        with self.shown():
            how = ESTIMATE if stated is None else STATE if stated else USUAL
            self.how.param.update(value=how, disabled=busy)
            known: dict[str, Any] = {name: _usual(q) for name, q in QUANTITIES.items()} | dict(stated or ())
            for name, widget in self.numbers.items():
                widget.param.update(value=known[name], visible=name in shown, disabled=busy)
        self.view.visible = question.data == OWN


def _number(quantity: Quantity, width: int) -> pn.widgets.FloatInput:
    name, least = f"σ of {quantity.name} [{quantity.unit}]", 0.0 if quantity.column in MAY_BE_EXACT else SMALLEST
    return pn.widgets.FloatInput(name=name, value=_usual(quantity), start=least, width=width)


def _usual(quantity: Quantity) -> float:
    """The paper's, in the unit of the column."""
    return float(f"{getattr(PAPER, quantity.error) / quantity.factor:.6g}")


def _of_bed(name: str) -> set[str]:
    return {quantity.column for quantity in (*BEDS[name].imposed, *BEDS[name].measured)}
