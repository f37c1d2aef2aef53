"""The function that a proposal says beside what the data say without a form: a table in engineering units."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from freelearn.inference.proposals.unknown import Unknown
from freelearn.models.written.inputs import Input
from freelearn.models.written.written import Written
from freelearn.results.formats import sentence

CURVES = ("form", "free", "low", "high")


@dataclass(frozen=True)
class ProposalCurve:
    """numbers: the input, then form, free, low and high, in the units of x and y. title: what it is."""

    title: str
    x: str
    y: str
    numbers: pd.DataFrame

    @classmethod
    def of(cls, written: Written, found: Unknown) -> ProposalCurve:
        """From what was found, in SI."""
        shown = {name: getattr(found, name) / written.place.factor for name in CURVES}
        table = pd.DataFrame({found.over.name: found.at / found.over.factor, **shown})
        return cls._of(written, found.over, table)

    @classmethod
    def from_table(cls, written: Written, table: pd.DataFrame) -> ProposalCurve | None:
        """From the table that a search wrote beside its picture; None where it is of something else."""
        over = next((i for i in written.inputs if i.name == table.columns[0]), None)
        return cls._of(written, over, table) if over is not None and [*table.columns[1:]] == [*CURVES] else None

    @classmethod
    def _of(cls, written: Written, over: Input, table: pd.DataFrame) -> ProposalCurve:
        place = written.place
        unit = f" [{over.shown}]" if over.shown else ""
        y = f"{'lost' if place.rubs else 'Δ'} {place.symbol}{f' [{place.shown}]' if place.shown else ''}".replace(
            "Δ ", "Δ"
        )
        return cls(sentence(written.formula).rstrip("."), f"{over.name} {over.symbol}{unit}", y, table)
