"""One model on the way of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from freelearn.inference.candidate import Candidate
from freelearn.inference.left_out import HeldOut
from freelearn.inference.noise import Whitener
from freelearn.inference.structure import Structure, structure
from freelearn.inference.thresholds import RISES
from freelearn.inference.white_fit import WhiteFit
from freelearn.measurements.states import States


@dataclass(frozen=True)
class Step:
    """One model on the way: its fit, held-out residuals, what is left, and the candidates that were tried on it.

    effects: all that the model has, the given ones first. E_train, E_heldout: the paper's error on the fitted rows and
    on held-out kinematic states; E_new_sample: on whole samples left out in turn (None with one sample, or where a
    parameter belongs to a sample); floor: what measuring alone leaves of it (fractions)."""

    effects: list[str]
    fit: WhiteFit
    whiten: Whitener
    heldout: HeldOut
    states: States
    E_train: float
    E_heldout: float
    E_new_sample: float | None
    floor: float
    candidates: Sequence[Candidate] = ()

    @cached_property
    def left(self) -> Structure:
        """What is systematic in the residuals that are left."""
        return structure(self.fit.residual, self.fit.jacobian, self.states, self.whiten)

    def worse(self, other: Step) -> bool:
        """Whether its held-out error is clearly larger than another's."""
        return self.E_heldout > (1 + RISES) * other.E_heldout

    def tried(self, candidates: Sequence[Candidate]) -> Step:
        """The same step with what was tried on it."""
        step = replace(self, candidates=candidates)
        if "left" in vars(self):  # known already, and dear
            vars(step)["left"] = self.left
        return step
