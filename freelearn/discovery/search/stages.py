"""From a model that is far off to one that measuring alone explains: sets looked at under less and less doubt.

A model that is wrong by some amount cannot be judged by digits beyond that. So sets are compared as if every reading
were off by about half of what the best of them leaves, then less, until measuring alone is left; and with many rows on
some of them first. Where no set comes down to what measuring leaves, the comparison stops at what the best one does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.common.progress import begin
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Prepared
from freelearn.discovery.fits.white_fit import WhiteFit, evaluated
from freelearn.discovery.noise.noise import Noise, Whitener
from freelearn.discovery.noise.scatter import Scatter
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.hypothesis import Hypothesis
from freelearn.discovery.thresholds import (
    INADEQUATE,
    MOST_LOWERED,
    REFITTED,
    RIGHT,
    SCOUTED,
    SETTLINGS,
    STEADY,
    WRONG_BY,
)

Told = Callable[[Hypothesis], None]


@dataclass(frozen=True)
class Explored:
    """What was looked at on all rows. noise: about the best set; share: of the largest loads, by which even that is
    wrong in every reading, zero where measuring explains it."""

    hypotheses: Hypotheses
    noise: Noise
    share: float

    @property
    def whiten(self) -> Whitener:
        """The noise that the measuring makes, no model's error in it."""
        return self.noise.whitener()


def explored(prepared: Prepared, fit: WhiteFit, noise: Noise, told: Told = lambda h: None) -> Explored:
    """Looks at sets of effects on top of the first model. told: of each set that is the best so far."""
    view = _View(prepared, noise, told)
    now = view.begin(fit)
    return view.lowered(now, 2 * view.misfit(now.best))


def continued(prepared: Prepared, before: Explored, odds: dict[str, float]) -> Explored:
    """The same with effects beside the library among the candidates. odds: theirs."""
    view = _View(prepared, before.noise, lambda h: None)
    now = Hypotheses(
        prepared.question, view.rows, before.hypotheses.whiten, prepared.spans, before.hypotheses.odds | odds,
        dict(before.hypotheses.found) if view.some is None else {},
    )  # fmt: skip
    if view.some is not None:
        now = before.hypotheses.under(
            view._whitener(before.share), view.rows, before.hypotheses.worth_keeping(REFITTED)
        )
        now.odds |= odds
    # The library's answer may have taken the place of what was written on top of the first model.
    now.expand(now.found[frozenset()])
    now.explore(view.told)
    return view.lowered(now, before.share)


class _View:
    """The rows that are looked at now, and the noise in them."""

    def __init__(self, prepared: Prepared, noise: Noise, told: Told) -> None:
        self.prepared, self.noise, self.told = prepared, noise, told
        self.some = scouted(prepared.rows)
        self.rows: Rows = prepared.rows if self.some is None else prepared.rows[self.some]
        self.scale = prepared.scale
        self.floor = noise.whitener().floor(self.scale)

    def begin(self, fit: WhiteFit) -> Hypotheses:
        """The first model alone."""
        question = self.prepared.question
        started = Hypotheses(question, self.rows, self._whitener(0.0), self.prepared.spans)
        started.fit((), fit.vector)
        return started

    def lowered(self, now: Hypotheses, share: float) -> Explored:
        """From sets looked at as if every reading were off by a share of the largest loads, on to less."""
        share = min(WRONG_BY * self.misfit(now.best), share / 2)
        for _ in range(MOST_LOWERED):
            if share <= RIGHT * self.floor:
                break
            now = self.moved(now, share)
            left = self.misfit(now.best)
            if _per_reading(now.best, self.rows) > INADEQUATE:
                return self.ended(now, left)
            share = min(WRONG_BY * left, share / 2)
        for _ in range(SETTLINGS):
            before = self.noise.scatter
            now = self.moved(now, 0.0)
            if _per_reading(now.best, self.rows) > INADEQUATE:
                return self.ended(now, self.misfit(now.best))
            if _steady(before, self.noise.scatter):
                break
        return self.ended(now, 0.0)

    def moved(self, before: Hypotheses, share: float) -> Hypotheses:
        """The sets under the noise about the best of them, and this share of the largest loads besides; looked at
        further."""
        begin("comparing sets of effects" + (f", to {100 * share:.2g} % of the largest loads" if share else ""))
        self.noise = self.prepared.noise(self._whole(before.best), self.noise.scatter)
        now = before.under(self._whitener(share), self.rows, before.worth_keeping(REFITTED))
        now.explore(self.told)
        return now

    def ended(self, last: Hypotheses, share: float) -> Explored:
        """The sets on all rows."""
        whole = last
        if self.some is not None or share:
            self.some, self.rows = None, self.prepared.rows
            whole = self.moved(last, share)
        return Explored(whole, self.noise, share)

    def misfit(self, best: Hypothesis) -> float:
        """The error of the best set on the rows looked at, as a share of the largest loads; readings that slipped do
        not count."""
        missed = best.fit.raw_residual / self.scale
        counts = self._scatter().reading > 0
        squares = (missed.square() * counts).sum(0) / counts.sum(0).clamp_min(1)
        return math.sqrt(float(squares.sum()))

    def _scatter(self) -> Scatter:
        return self.noise.scatter if self.some is None else self.noise.scatter.of(self.some)

    def _whitener(self, share: float) -> Whitener:
        return self.noise.whitener(share * self.scale if share else None, self.some)

    def _whole(self, best: Hypothesis) -> WhiteFit:
        """The set's model on all rows."""
        if len(best.fit.raw_residual) == len(self.prepared.rows):
            return best.fit
        return evaluated(best.fit.model, self.prepared.rows, best.fit.vector)


def scouted(rows: Rows) -> Tensor | None:
    """Numbers of the rows to look at first, (n,) int64; None for all. Of each kinematic state some, evenly over it."""
    if len(rows) <= SCOUTED:
        return None
    every = -(-len(rows) // SCOUTED)
    state = torch.as_tensor(rows.state)
    first = torch.cat([torch.ones(1, dtype=torch.bool), state[1:] != state[:-1]])
    visit = torch.cumsum(first, 0) - 1
    begun = torch.nonzero(first)[:, 0]
    place = torch.arange(len(rows)) - begun[visit]
    # Each state begins at another of its rows, so that together they have all steps of the pressure.
    return torch.nonzero((place + visit) % every == 0)[:, 0]


def _per_reading(best: Hypothesis, rows: Rows) -> float:
    return best.fit.chi2 / max(rows.readings.count, 1)


def _steady(before: Scatter, now: Scatter) -> bool:
    sizes = [(float(a), float(b)) for a, b in zip(before.deviations, now.deviations, strict=True)]
    sizes.append((before.position, now.position))
    return all(abs(math.log(b / a)) < STEADY for a, b in sizes if a > 0 and b > 0)
