"""Beyond the library: when a search writes an effect itself, and when that takes the place of the library's."""

from __future__ import annotations

import math
from functools import cached_property

from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.extend import Extended, Grow, extended
from freelearn.inference.step import Step
from freelearn.inference.thresholds import CHEAPER, LEFT, MANY
from freelearn.inference.white_fit import white_fit


class Beyond:
    """What can be written on top of a search's first model, looked for when it is first asked for.

    grow: adds to the last of some steps what the library has."""

    def __init__(self, prepared: Prepared, first: Step, grow: Grow) -> None:
        self.prepared, self.first, self.grow = prepared, first, grow

    @cached_property
    def on_first(self) -> Extended | None:
        """On top of the first model."""
        return extended(self.prepared, [self.first], self.grow)

    def ends(self, step: Step) -> bool:
        """Whether the library need not be searched any further: what it has found leaves something, by one effect or by
        several, and what is written leaves nothing."""
        return step.left.p_value < LEFT and self.on_first is not None and self.on_first.complete

    def instead(self, last: Step) -> Extended | None:
        """What stands instead of the library's last model: where that leaves something, what is written on the first
        model or on it; where it takes several effects to leave nothing, a written one that explains clearly more. An
        effect of the library that does it alone always wins."""
        added = self.prepared.question.added(last.effects)
        if last.left.p_value < LEFT:
            if self.on_first is not None and self.on_first.complete:
                return self.on_first
            on_last = extended(self.prepared, [last], self.grow) if added else None
            tried = [found for found in (on_last, self.on_first) if found is not None]
            return next((found for found in tried if found.complete), tried[-1] if tried else None)
        if len(added) < MANY or self.on_first is None or not self.on_first.complete:
            return None
        return self.on_first if self._cheaper(self.on_first.step, last) else None

    def _cheaper(self, step: Step, other: Step) -> bool:
        """Whether a step explains clearly more than another for its constants, both with its own noise."""
        fit = white_fit(other.fit.model, self.prepared.rows, step.whiten, other.fit.vector)
        constants = math.log(max(step.whiten.count, 2)) * (len(fit.vector) - len(step.fit.vector))
        return (fit.chi2 - step.fit.chi2) / step.left.scale**2 + constants > CHEAPER
