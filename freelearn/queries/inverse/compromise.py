"""Answers of the rows of one pattern: exact ones, and where there is none the nearest and the best agreement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.blanks import Pattern, nearest
from freelearn.queries.inverse.miss import Miss
from freelearn.queries.inverse.nodes import Grid
from freelearn.queries.inverse.roots import Roots, stays
from freelearn.queries.inverse.system import Span, System

# Answers of the rows of one pattern, and the words for how good they are.

# Beyond the statuses of prediction.
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


# Rows without an exact answer: the nearest that can be reached, and the best agreement.

# A miss below this share of the largest output counts as none, where there are as many equations as unknowns; where
# the least pressures are looked for, their small weight leaves some.
MET, NEARLY = 1e-7, 1e-4
# χ² per equation beyond which a state and its loads do not belong together: 99.9 % of measurements lie below.
AGREES = 10.8


@dataclass(frozen=True)
class Compromise:
    """span: where it looks; scale (2,): what outputs count in; miss: how far a measurement may lie from the model, None
    where nobody knows; hung: whether the bed hangs loads on the actuator."""

    span: Span
    scale: Tensor
    miss: Miss | None
    hung: bool

    def reached(self, system: System, pattern: Pattern, x: Tensor, y: Tensor, found: Found, lost: Tensor) -> Found:
        """Rows in which no cell held a root: a root that the cells missed, or the nearest that can be reached."""
        asked, given = list(pattern.asked), list(pattern.given)
        part, wanted = system[lost], y[lost][:, given]
        begin = x[lost]
        begin[:, asked] = _best_node(Grid(part, begin, asked, given, self.span), wanted, self.scale[given])
        low, high = self.span.box(part)
        at = nearest(part, begin, asked, given, wanted, self.scale[given], (low, high))
        outputs, slopes = part.slopes(at)
        met = ((outputs[:, given] - wanted).abs() <= MET * self.scale[given]).all(-1)
        why = "nothing within the span looked through carries these loads: the nearest is given"
        return found.filled(lost, self._told(part, pattern, at, outputs, slopes, met, why))

    def agreed(self, system: System, pattern: Pattern, x: Tensor, y: Tensor) -> Found:
        """More equations than inputs asked for, or fewer: the best agreement, by the least pressures."""
        asked, given = list(pattern.asked), list(pattern.given)
        wanted, scale = y[:, given], self.scale[given]
        light = [i for i in asked if i >= 2]
        low, high = self.span.box(system)
        begin = x.clone()
        if len(asked) == 1:
            begin[:, asked] = _best_node(Grid(system, x, asked, given, self.span), wanted, scale)
        else:
            rest = system.states.reference_length
            for i in asked:
                begin[:, i] = rest if i == 0 and system.mechanical else low[:, i].clamp_min(0.0)
        at = nearest(system, begin, asked, given, wanted, scale, (low, high), light)
        outputs, slopes = system.slopes(at)
        agrees = self._agrees(system, at, slopes, outputs[:, given] - wanted, given, scale)
        why = "no value agrees with all that is given: the nearest is given"
        return self._told(system, pattern, at, outputs, slopes, agrees, why)

    def _told(
        self, system: System, pattern: Pattern, x: Tensor, outputs: Tensor, slopes: Tensor, good: Tensor, why: str
    ) -> Found:
        """What is said of inputs x (n, m) that were found: whether they solve their row, good (n,) bool, and why else
        they are no answer."""
        state, stable = system.at(x).status, stays(slopes, pattern.free(system, self.hung))
        balloons = state == Status.NO_EQUILIBRIUM
        good = good & ~balloons
        x[balloons[:, None] & _among(pattern.asked, x)], outputs[balloons] = torch.nan, torch.nan
        words = [said(*each) for each in zip(state.tolist(), stable.tolist(), strict=True)]
        for row in torch.nonzero(~good & ~balloons)[:, 0].tolist():
            words[row] = UNREACHABLE, why
        status, reasons = [word for word, _ in words], [text for _, text in words]
        return Found(x, outputs, slopes, good.long(), status, reasons, Roots.none(x.shape[1]))

    def _agrees(
        self, system: System, x: Tensor, slopes: Tensor, miss: Tensor, given: list[int], scale: Tensor
    ) -> Tensor:
        """Whether what is left is no more than measuring makes of it, (N,) bool."""
        exact = (miss.abs() <= NEARLY * scale).all(-1)
        if self.miss is None:
            return exact
        covariance = self.miss.spread(system, x, slopes).covariance[:, given][:, :, given]
        # In units of what the outputs count in: well scaled.
        covariance = covariance / scale / scale[:, None] + 1e-18 * torch.eye(len(given), dtype=torch.float64)
        # Where the model has no answer, nothing agrees.
        told = covariance.isfinite().all(-1).all(-1) & miss.isfinite().all(-1)
        covariance = torch.where(told[:, None, None], covariance, torch.eye(len(given), dtype=torch.float64))
        white = torch.linalg.solve_triangular(
            torch.linalg.cholesky(covariance), (miss / scale)[..., None], upper=False
        )[..., 0]  # fmt: skip
        agrees: Tensor = exact | (told & (white.square().sum(-1) <= AGREES * len(given)))
        return agrees


def _among(asked: Sequence[int], x: Tensor) -> Tensor:
    """Which of the inputs (N, m) are asked for, (m,) bool."""
    return torch.isin(torch.arange(x.shape[1]), torch.tensor(asked))


def _best_node(grid: Grid, wanted: Tensor, scale: Tensor) -> Tensor:
    """Place (N, a) of each row's node whose outputs miss those wanted (N, b) least."""
    found = torch.empty(len(wanted), len(grid.asked), dtype=torch.float64)
    for rows, nodes in grid.parts():
        there = wanted[rows].reshape(len(rows), *[1] * len(nodes.axes), -1)
        best = ((nodes.outputs - there) / scale).square().sum(-1).flatten(1).nan_to_num(torch.inf).argmin(1)
        each = torch.arange(len(rows))
        for k in reversed(range(len(nodes.axes))):
            n = nodes.axes[k].shape[1]
            found[rows, k] = nodes.axes[k][each, best % n]
            best = best // n
    return found
