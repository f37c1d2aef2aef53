"""Drawings of the states that the slider has been on, and of those that it comes to next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import panel as pn

from freelearn.render.html.charts.curves import Drawing

# Drawings made ahead of the slider, and how long after a move [ms]: what it has just asked for is on its way by then.
AHEAD, PAUSE = 2, 40
# Drawings kept, of some 100 kB each, in every tab.
KEPT = 40


class Ahead:
    """Makes drawings once, and the next ones while nobody waits. make: the drawing of a curve, by its number."""

    def __init__(self, make: Callable[[int], Drawing]) -> None:
        self.make = make
        self.kept: dict[int, Drawing] = {}
        self.next: Sequence[int] = ()
        self.waiting: Any = None

    def clear(self) -> None:
        """Forgets all of them: they would show something else now."""
        self.kept, self.next = {}, ()

    def drawing(self, curve: int) -> Drawing:
        """The drawing of a curve."""
        if curve not in self.kept:
            if len(self.kept) >= KEPT:
                del self.kept[next(iter(self.kept))]
            self.kept[curve] = self.make(curve)
        return self.kept[curve]

    def come_to(self, curves: Sequence[int]) -> None:
        """Has the drawings of these curves made soon, the first ones of those that are missing."""
        self.next = curves[:AHEAD]
        document = pn.state.curdoc
        if document is not None and self.waiting is None and not set(self.next) <= set(self.kept):
            self.waiting = document.add_timeout_callback(self._make_one, PAUSE)

    def _make_one(self) -> None:
        self.waiting = None
        missing = [curve for curve in self.next if curve not in self.kept]
        if missing:
            self.drawing(missing[0])
            self.come_to(self.next)
