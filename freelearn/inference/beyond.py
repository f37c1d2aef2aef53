"""Beyond the library: when a search writes an effect itself, and when that takes the place of the library's."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.extend import Extended, Grow, extended
from freelearn.inference.proposals.propose import guessed
from freelearn.inference.proposals.trial import price
from freelearn.inference.step import Step
from freelearn.inference.thresholds import CHEAPER, LEFT, MANY, NEAR_NOISE
from freelearn.inference.white_fit import white_fit


class Beyond:
    """What can be written on top of a search's first model, looked for when it is first asked for.

    grow: adds to the last of some steps what the library has."""

    def __init__(self, prepared: Prepared, first: Step, grow: Grow) -> None:
        self.prepared, self.first, self.grow = prepared, first, grow

    @cached_property
    def on_first(self) -> Extended | None:
        """On top of the first model."""
        return extended(self.prepared, self.first, self.grow)

    def ends(self, step: Step) -> bool:
        """Whether the library need not be searched any further: what it has found leaves something, by one effect or by
        several, and what is written leaves nothing but about the noise that was stated."""
        if step.left.p_value >= LEFT or self.on_first is None or not self.on_first.complete:
            return False
        heldout, count = self.on_first.step.heldout, self.on_first.step.whiten.count
        return float(heldout.white.square().sum()) <= NEAR_NOISE**2 * count and not self.on_first.step.worse(step)

    def instead(self, last: Step) -> Extended | None:
        """What stands instead of the library's last model: where that leaves something, what is written on the first
        model or on it; where it leaves nothing, a written effect that explains clearly more for its constants. What of
        the library explains as much always wins."""
        added = self.prepared.question.added(last.effects)
        if last.left.p_value < LEFT:
            first = self._no_worse(self.on_first, last)
            if first is not None and first.complete:
                return first
            on_last = self._no_worse(extended(self.prepared, last, self.grow) if added else None, last)
            tried = [found for found in (on_last, first) if found is not None]
            return next((found for found in tried if found.complete), tried[-1] if tried else None)
        if not added or not (len(added) >= MANY or self._promises(last)):
            return None
        found = self._as_short(last)
        return found if found is not None and found.complete and self._cheaper(found.step, last) else None

    def _as_short(self, last: Step) -> Extended | None:
        """What is written on the first model, with what the library adds to it only as long as that has no more
        constants than a last model that leaves nothing."""
        if "on_first" in vars(self):
            return self.on_first
        return extended(self.prepared, self.first, self.grow, len(last.fit.vector))

    @staticmethod
    def _no_worse(found: Extended | None, last: Step) -> Extended | None:
        """The same, but a hint alone where it predicts clearly worse than the library's last model."""
        return replace(found, complete=False) if found is not None and found.step.worse(last) else found

    def _promises(self, last: Step) -> bool:
        """Whether a form of one input promises, to first order, clearly more than the library's last model has."""
        first, scale = self.first, self.first.left.scale**2
        guesses = guessed(self.prepared, first, pairs=False)
        fit = white_fit(last.fit.model, self.prepared.rows, first.whiten, last.fit.vector)
        worth = (first.fit.chi2 - fit.chi2) / scale
        worth -= price(len(fit.vector) - len(first.fit.vector), 1, first.whiten.count)
        return bool(guesses) and guesses[0].worth > worth + CHEAPER

    def _cheaper(self, step: Step, other: Step) -> bool:
        """Whether a step explains clearly more than another for its constants, both with its own noise."""
        fit = white_fit(other.fit.model, self.prepared.rows, step.whiten, other.fit.vector)
        fewer = len(fit.vector) - len(step.fit.vector)
        if len(self.prepared.question.added(other.effects)) < MANY:
            # An effect of the library comes whole: that data do not ask for one of its constants speaks for no other.
            fewer = min(fewer, 0)
        constants = price(fewer, 1, step.whiten.count)
        return (fit.chi2 - step.fit.chi2) / step.left.scale**2 + constants > CHEAPER
