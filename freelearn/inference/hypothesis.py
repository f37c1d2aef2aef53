"""A set of effects that may be what a model lacks, with its fit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from freelearn.inference.white_fit import WhiteFit

Effects = frozenset[str]


@dataclass(frozen=True)
class Hypothesis:
    """effects: those added to the question's own, in the order of the library. fit: at the most probable parameters.
    evidence: logarithm of its probability, up to a constant that all hypotheses under the same noise share."""

    effects: tuple[str, ...]
    fit: WhiteFit
    evidence: float

    @cached_property
    def key(self) -> Effects:
        """The effects, whatever their order."""
        return frozenset(self.effects)
