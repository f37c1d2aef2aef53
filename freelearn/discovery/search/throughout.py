"""Is each effect seen by stretches of the session apart, or by errors that go on from row to row?

How sure a fit is of an effect counts every reading's error as one by itself. A zero that wanders, or a room that warms,
errs for minutes in one direction: over many rows that looks like an effect. Stretches of the session that are longer
than such errors last know nothing of each other: what they say of an effect's size scatters by its true uncertainty
(Liang & Zeger 1986; their small number as by Bell & McCaffrey 2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
from scipy import stats
from torch import Tensor

from freelearn.common.formats import in_words
from freelearn.data.rows import Rows
from freelearn.discovery.fits.journal import ahead
from freelearn.discovery.fits.prepare import Prepared, fit_without
from freelearn.discovery.fits.step import Step
from freelearn.discovery.noise.linear_algebra import SMALLEST
from freelearn.discovery.noise.shapes import rows_of_samples
from freelearn.discovery.referee.case import CANNOT, PASS, Check
from freelearn.discovery.thresholds import FEW_STATES

NAME = "throughout the session"
# Stretches of all samples together, and of each at least.
STRETCHES, FEWEST = 16, 4
# Chance of calling what errors alone make an effect.
CHANCE = 2e-3
# Share of an effect that one stretch shows at which nothing can be said of how stretches differ; and the
# share of its sureness that is left by how they differ, above which that may be chance.
LOCAL, ALIKE = 0.8, 0.6


def throughout(prepared: Prepared, final: Step, added: Sequence[str]) -> list[Check]:
    """One check of the effects that were added, where there are stretches enough; of the least sure one it tells."""
    rows = prepared.rows
    if final.whiten.states < FEW_STATES or rows.states.recording is not None or not added:
        return []
    stretch = stretches(rows)
    ahead([partial(fit_without, prepared, final, effect) for effect in added])
    least = None
    for effect in added:
        fewer = fit_without(prepared, final, effect)
        if fewer is None:
            continue
        freedom = max(len(final.fit.vector) - len(fewer.vector), 1)
        alone, errors, needed = sigmas(fewer.residual, final.fit.residual, stretch, freedom)
        if not np.isfinite(errors):
            continue
        needed = min(needed, ALIKE * alone)
        if least is None or errors / needed < least[2] / least[3]:
            least = effect, alone, errors, needed
    if least is None:
        return []
    effect, alone, errors, needed = least
    if errors >= needed:
        says = (
            f"Stretches of the session agree on every effect: even {effect} is {in_words(errors, 2)} times as large as "
        )
        return [Check(NAME, PASS, errors, needed, f"{says}they differ.", decides=False)]
    says = (
        f"{effect} is {in_words(alone, 2)} times as large as its error if each reading errs by itself, and "
        f"{in_words(errors, 2)} times as large as stretches of the session differ: errors that go on from row to row, "
        "such as a zero that wanders, would look like it. Measure some states again at other times."
    )
    return [Check(NAME, CANNOT, errors, needed, says)]


def sigmas(fewer: Tensor, final: Tensor, stretch: Tensor, freedom: int) -> tuple[float, float, float]:
    """How many times its error an effect is if each reading errs by itself, if stretches do (infinite where one of them
    alone shows it), and has to be.

    fewer, final: whitened residuals (N, 2) without it and with it; stretch (N,) int64: each row's; freedom: of its
    parameters."""
    made = fewer - final
    count = int(stretch.max()) + 1

    def each(of: Tensor) -> Tensor:
        return torch.zeros(count, dtype=of.dtype).index_add_(0, stretch, of.sum(1))

    size = each(made.square())
    whole = float(size.sum().clamp_min(SMALLEST))
    share = size / whole
    if float(share.max()) > LOCAL:
        return whole**0.5, float("inf"), 1.0
    off = each(made * final) / (1 - share).sqrt()
    sure = whole / float(off.square().sum().clamp_min(SMALLEST)) ** 0.5
    # Satterthwaite's degrees of freedom, of stretches that show the effect by these shares.
    least = stats.f.isf(CHANCE, freedom, max(1 / float(share.square().sum()) - 1, 1.0))
    return whole**0.5, sure, float((freedom * least) ** 0.5)


def stretches(rows: Rows) -> Tensor:
    """Number of the stretch of its sample's session that each row belongs to, (N,) int64: of whole visits, as many in
    each."""
    samples, state = rows_of_samples(rows.states), torch.as_tensor(rows.state)
    most = max(FEWEST, -(-STRETCHES // len(samples)))
    number, first = torch.zeros(len(rows), dtype=torch.int64), 0
    for own in samples:
        _, visit = torch.unique_consecutive(state[own], return_inverse=True)
        visits = int(visit.max()) + 1
        number[own] = first + visit * min(most, visits) // visits
        first += min(most, visits)
    return number
