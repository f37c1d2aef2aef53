"""Where a search for an equilibrium may begin: near where the last one for the same rows ended."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.vmapped import everyone


class Near:
    """The place of each row, length [m] and twist [rad], at which the last search ended: a fit's next one ends nearby.

    Kept only where derivatives are asked for, which a fit does at the points that it accepts: so a trial step and the
    derivatives taken there begin from one place, and follow one branch.
    """

    def __init__(self) -> None:
        self._place: Tensor | None = None

    @property
    def moved(self) -> bool:
        """Whether a search has ended anywhere: the next one then depends on those before it."""
        return self._place is not None

    def start(self, otherwise: Tensor) -> Tensor:
        """Where to begin, (N, 2): at the last place of the rows that have one."""
        if self._place is None or self._place.shape != otherwise.shape:
            return otherwise
        return torch.where(self._place.isfinite(), self._place, otherwise)

    def keep(self, place: Tensor, settled: Tensor) -> None:
        """Remembers the place (N, 2) of the rows that settled, (N,) bool."""
        # Inside vmap a place is that of several members.
        if torch.is_grad_enabled() and everyone(settled) is not None:
            self._place = torch.where(settled[:, None], place, torch.nan)
