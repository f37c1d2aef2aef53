"""Whether repeats of a state differ as the stated accuracy lets them."""

from __future__ import annotations

import numpy as np
import torch

from freelearn.inference.accuracy import FEWEST_REPEATS, repeat_rows, repeat_scale
from freelearn.inference.checks.check import CANNOT, FAIL, PASS, TableCheck
from freelearn.inference.checks.plain import Plain
from freelearn.inference.noise import Whitener, sensitivities
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.rows import Rows

NAME = "stated accuracy"
# Times that repeats may scatter as much as was stated: calibrations differ by one and a half, slips and tails by more.
MOST = 3.5
# Repeats that are looked at, at most.
ENOUGH = 200


def repeated(plain: Plain, accuracy: Accuracy, stated: bool) -> TableCheck:
    """stated: whether the user gave the accuracy; an estimate comes from the repeats themselves."""
    if not stated:
        return TableCheck(NAME, CANNOT, None, MOST, "The accuracy is estimated from the table.")
    rows = Rows.from_table(plain.table)
    groups = repeat_rows(rows)
    if len(groups) < FEWEST_REPEATS:
        return TableCheck(NAME, CANNOT, None, MOST, f"{len(groups)} places were visited again: too few to tell.")
    some = np.sort(np.concatenate(groups[:: max(1, len(groups) // ENOUGH)]))
    rows = rows[torch.as_tensor(some)]
    model = plain.build(plain.given)
    model.prepare(rows)
    model.set_values(plain.itself.values)
    with torch.no_grad():
        missed = rows.readings.missed(model(rows.states).loads)
    state, bed = torch.as_tensor(rows.state), rows.states.bed
    whiten = Whitener(sensitivities(model, rows.states), state, accuracy, None, bed, rows.readings.present)
    scale = repeat_scale(missed, rows, whiten)
    if scale is None or not np.isfinite(scale):
        return TableCheck(NAME, CANNOT, None, MOST, "Too few places were visited again to tell.")
    if scale <= MOST:
        return TableCheck(NAME, PASS, scale, MOST, "Repeats differ no more than the stated accuracy lets them.")
    says = (
        f"Repeats of {len(groups)} places scatter {scale:.2g} times as much as data.accuracy says: state what the bed "
        "really does, or let it be estimated."
    )
    return TableCheck(NAME, FAIL, scale, MOST, says, "data.accuracy=estimate")
