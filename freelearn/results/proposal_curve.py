"""The function that a proposal says beside what the data say without a form: a table in engineering units."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from freelearn.inference.proposals.unknown import Unknown
from freelearn.models.written.written import Written
from freelearn.results.formats import sentence


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
        place, over = written.place, found.over
        unit = f" [{over.shown}]" if over.shown else ""
        shown = {
            name: getattr(found, name) / place.factor for name in ("form", "free", "low", "high")
        }  # fmt: skip
        y = f"{'lost' if place.rubs else 'Δ'} {place.symbol}{f' [{place.shown}]' if place.shown else ''}".replace(
            "Δ ", "Δ"
        )
        table = pd.DataFrame({over.name: found.at / over.factor, **shown})
        return cls(sentence(written.formula).rstrip("."), f"{over.name} {over.symbol}{unit}", y, table)
