"""Answers of the rows of one pattern, and the words for how good they are."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.roots import Roots
from freelearn.answer.system import System
from freelearn.models.prediction import Status

# Beyond the statuses of models.prediction.
UNSTABLE, UNREACHABLE, UNANSWERED = "unstable", "unreachable", "unanswered"
# Answers that have bands: around the nearest to one there is none.
BANDED = ("ok", UNSTABLE, "overstretched")


@dataclass(frozen=True)
class Found:
    """Answers of n rows: x (n, m), outputs (n, 2), slopes (n, 2, m), how many, status and words; every solution of rows
    with several, by their number among the n."""

    x: Tensor
    outputs: Tensor
    slopes: Tensor
    count: Tensor
    status: list[str]
    why: list[str]
    every: Roots

    def filled(self, rows: Tensor, more: Found) -> Found:
        """With more answers in the place of those of some rows (k,); they have no further solutions."""
        status, why = list(self.status), list(self.why)
        for row, word, text in zip(rows.tolist(), more.status, more.why, strict=True):
            status[row], why[row] = word, text
        return Found(
            self.x.index_copy(0, rows, more.x),
            self.outputs.index_copy(0, rows, more.outputs),
            self.slopes.index_copy(0, rows, more.slopes),
            self.count.index_copy(0, rows, more.count),
            status,
            why,
            self.every,
        )


def direct(system: System, x: Tensor) -> Found:
    """Where nothing has to be found: the outputs at inputs x (n, m)."""
    outputs, slopes = system.slopes(x)
    state = system.at(x).status
    # A number too large to be one is no answer either.
    lost = (state == Status.NO_EQUILIBRIUM) | ~outputs.isfinite().all(-1)
    status = [said(int(s), True)[0] for s in torch.where(lost, Status.NO_EQUILIBRIUM, state)]
    outputs = torch.where(lost[:, None], torch.nan, outputs)
    count = (~lost).long()
    return Found(x, outputs, slopes, count, status, [""] * len(x), Roots.none(x.shape[1]))


def taken(some: Roots, chosen: Tensor, count: Tensor, x: Tensor) -> Found:
    """The roots chosen, places among some (n,) or −1; count (n,): how many each row has; x (n, m): inputs given."""
    there = chosen >= 0
    at, outputs = x.clone(), torch.full((len(x), 2), torch.nan, dtype=x.dtype)
    slopes = torch.full((len(x), 2, x.shape[1]), torch.nan, dtype=x.dtype)
    at[there], outputs[there], slopes[there] = (
        values[chosen[there]] for values in (some.x, some.outputs, some.slopes)
    )  # fmt: skip
    words = [(UNREACHABLE, "")] * len(x)
    root = chosen[there]
    each = zip(torch.nonzero(there)[:, 0].tolist(), some.status[root].tolist(), some.stable[root].tolist(), strict=True)
    for row, state, stable in each:
        words[row] = said(state, stable)
    status, why = [word for word, _ in words], [text for _, text in words]
    return Found(at, outputs, slopes, count, status, why, some[count[some.row] > 1])


def said(status: int, stable: bool) -> tuple[str, str]:
    """The word for a solution, and a few more where it is no good."""
    if status != Status.OK:
        return Status(status).name.lower(), ""
    if not stable:
        return UNSTABLE, "it would not stay there under these loads"
    return "ok", ""
