"""Whether the model fits far better where a column is read otherwise: signs, columns, units and lengths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from freelearn.inference.checks.actuator import actuator
from freelearn.inference.checks.check import FAIL, PASS, TableCheck
from freelearn.inference.checks.plain import Plain, PlainFit
from freelearn.inference.checks.reading import KINDS, Reading, readings
from freelearn.measurements.columns import Columns

# E from which a table is read otherwise at all: library effects of the sizes that real actuators have leave less; or
# how many times stiffer than any rubber or thread the fit is. So many times less than the table as it stands another
# reading must leave, and no more than this share.
DOUBTED, STIFF, SEVERAL, FITS = 0.1, 2.0, 2.5, 0.35
# What noise leaves of any fit, and how much worse one counts for each e-fold that its C1 or C2 is out of what is known.
LEAST, WORSE, MOST_SOFT = 0.02, 2.0, 10.0
# Readings that are fitted with care, of those that a rough look promises most; those within this ratio of the best are
# told beside it, so many at most. Pressures that no bed has [kPa].
CAREFUL, ALIKE, TOLD, PRESSURES = 6, 1.3, 3, (1.0, 5000.0)


@dataclass(frozen=True)
class Meant:
    """A reading, the E that it leaves, and E with what is known of C1 and C2."""

    reading: Reading
    E: float
    score: float


def meant(plain: Plain) -> Iterator[TableCheck]:
    """A check of each kind."""
    itself = plain.itself
    own = max(itself.E, LEAST) * (1 + WORSE * math.log(itself.stiff))
    tried = _tried(plain) if itself.E >= DOUBTED or itself.stiff >= STIFF else []
    best = tried[0] if tried else None
    # A fault of one kind makes readings of other kinds fit better too: only the best is told.
    for kind, fine in KINDS.items():
        of_kind = [m.score for m in tried if m.reading.kind == kind]
        figure = own / min(of_kind) if of_kind else None
        if best is None or best.reading.kind != kind or best.score > own / SEVERAL or best.E > FITS:
            yield TableCheck(kind, PASS, figure, SEVERAL, fine)
            continue
        alike = [m.reading for m in tried if m.score <= ALIKE * best.score][:TOLD]
        why = f"E falls from {100 * itself.E:.3g} to {100 * best.E:.3g} %"
        if itself.stiff >= STIFF:
            why += f", and the wall is no longer {itself.stiff:.2g} times stiffer than any rubber or thread"
        says = f"It looks as if {', or '.join(r.says for r in alike)}: {why}; {', or '.join(r.cure for r in alike)}."
        yield TableCheck(kind, FAIL, figure, SEVERAL, says)


def _tried(plain: Plain) -> list[Meant]:
    """The most promising ways to read the table, the best first."""
    changed = [(reading, reading.change(plain.some)) for reading in readings(plain.some)]
    changed = [(reading, table) for reading, table in changed if _possible(table)]
    rough = [(_score(plain.of(table, roughly=True)), number) for number, (_, table) in enumerate(changed)]
    hopeful = [changed[number] for _, number in sorted(rough)[:CAREFUL]]
    fits = [(reading, plain.of(table)) for reading, table in hopeful]
    return sorted([Meant(reading, fit.E, _score(fit)) for reading, fit in fits], key=lambda m: m.score)


def _score(fit: PlainFit) -> float:
    return max(fit.E, LEAST) * (1 + WORSE * math.log(fit.stiff * min(fit.soft, MOST_SOFT)))


def _possible(table: pd.DataFrame) -> bool:
    """Whether there are such actuators, and such pressures."""
    largest = max(float(table[name].abs().max()) for name in Columns.of(table).pressures)
    return actuator(table).status == PASS and PRESSURES[0] <= largest <= PRESSURES[1]
