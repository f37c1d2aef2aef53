"""A model without and with its effects, on the rows that both answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from freelearn.results.formats import error_percent, finite, fixed
from freelearn.results.tables import DisplayTable


@dataclass(frozen=True)
class Compared:
    """E of one test set (fractions) without and with the effects, whole kinematic states that neither fit saw.

    n: rows scored, those that both models answer: the same ones, or the model that answers less would look better.
    """

    without: float
    with_effects: float
    n: int

    def plain(self) -> dict[str, float | None]:
        """The entry in results.json."""
        return {"without": finite(self.without), "with": finite(self.with_effects), "n": self.n}


def comparison_table(comparison: Mapping[str, Compared]) -> DisplayTable:
    """E without and with the effects by test set, and their ratio."""
    rows = []
    for name, pair in comparison.items():
        ratio = fixed(pair.with_effects / pair.without if pair.without > 0 else None, 2)
        rows.append([name, error_percent(pair.without), error_percent(pair.with_effects), ratio, str(pair.n)])
    return DisplayTable.of(
        ["test set"],
        ["E without %", "E with effects %", "ratio", "rows"],
        rows,
        title="Without and with the effects",
        caption="Whole kinematic states that neither fit saw; scored on the rows that both answer.",
    )
