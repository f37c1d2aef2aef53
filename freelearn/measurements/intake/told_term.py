"""A term of a recipe as provenance tells it."""

from __future__ import annotations

from typing import Any

from freelearn.measurements.intake.recipe import Term


def described(term: Term) -> Any:
    """A term as plain values."""
    if term.number is not None:
        return term.number
    if term.thrust_on is not None:
        return {"pressure_on": described(term.thrust_on)}
    return term.column if term.column is not None else {"from": term.source, "unit": term.unit}
