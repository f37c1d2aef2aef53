"""Rows without an exact answer: the nearest that can be reached, and the best agreement."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.blanks import Pattern
from freelearn.answer.found import UNREACHABLE, Found, said
from freelearn.answer.miss import Miss
from freelearn.answer.nearest import nearest
from freelearn.answer.nodes import Grid
from freelearn.answer.roots import Roots, stays
from freelearn.answer.span import Span
from freelearn.answer.system import System
from freelearn.models.prediction import Status

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
        state = part.at(at).status
        balloons = state == Status.NO_EQUILIBRIUM
        met = ((outputs[:, given] - wanted).abs() <= MET * self.scale[given]).all(-1) & ~balloons
        stable = stays(slopes, pattern.free(system, self.hung))
        at[balloons[:, None] & _among(asked, x)], outputs[balloons] = torch.nan, torch.nan
        found.x[lost], found.outputs[lost], found.slopes[lost] = at, outputs, slopes
        found.count[lost] = met.long()
        for i, row in enumerate(lost.tolist()):
            found.status[row], found.why[row] = said(int(state[i]), bool(stable[i]))
            if not met[i] and not balloons[i]:
                found.status[row] = UNREACHABLE
                found.why[row] = "nothing within the span looked through carries these loads: the nearest is given"
        return found

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
        state = system.at(at).status
        stable = stays(slopes, pattern.free(system, self.hung))
        balloons = state == Status.NO_EQUILIBRIUM
        agrees = self._agrees(system, at, slopes, outputs[:, given] - wanted, given, scale) & ~balloons
        at[balloons[:, None] & _among(asked, x)], outputs[balloons] = torch.nan, torch.nan
        status, why = [], []
        for i in range(len(x)):
            word, text = said(int(state[i]), bool(stable[i]))
            if not agrees[i] and not balloons[i]:
                word, text = UNREACHABLE, "no value agrees with all that is given: the nearest is given"
            status.append(word)
            why.append(text)
        none = Roots.none(x.shape[1])
        return Found(at, outputs, slopes, agrees.long(), status, why, none)

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


def _among(asked: list[int], x: Tensor) -> Tensor:
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
