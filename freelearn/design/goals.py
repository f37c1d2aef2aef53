"""What a plan is for: to split effects that look alike, to settle whether one is there, to narrow a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
import torch
from torch import Tensor

from freelearn.design.known import Ahead, Known, ahead
from freelearn.inference.white_fit import WhiteFit
from freelearn.measurements.states import States

SPLIT, SETTLE, HALVE = "split", "settle", "halve"
# Standard deviations by which a difference counts as told: chance then leaves it undecided in one of fifty cases.
SURE = 5.0


@dataclass(frozen=True)
class Telling:
    """One thing that rows tell. columns: (n, 2, k) derivatives of what the rows show, SI, by coefficients that are
    refitted and then by those of interest, which are one where the thing is as large as it is thought to be. known:
    (k, k), what is told already."""

    name: tuple[str, ...]
    columns: Tensor
    known: np.ndarray
    interest: int


@dataclass(frozen=True)
class Goal:
    """kind: split, settle or halve. names: the pairs of effects (that which is there, and its rival), the effect or the
    parameter."""

    kind: str
    names: tuple[tuple[str, ...], ...]

    def tellings(self, known: Known, states: States) -> tuple[list[Telling], Tensor]:
        """What rows at n states tell, and which of them have an answer, (n,) bool."""
        raise NotImplementedError


@dataclass(frozen=True)
class Split(Goal):
    """fits: of every member of every class, by class and effect."""

    fits: Sequence[Mapping[str, WhiteFit]] = ()

    @classmethod
    def of(cls, fits: Sequence[Mapping[str, WhiteFit]]) -> Split:
        """Every member against every other of its class, whichever of them is there."""
        return cls(SPLIT, tuple(pair for members in fits for pair in permutations(members, 2)), fits)

    def without(self, pairs: Sequence[tuple[str, ...]]) -> Split:
        """Without pairs that cannot be told."""
        return Split(SPLIT, tuple(pair for pair in self.names if pair not in pairs), self.fits)

    def tellings(self, known: Known, states: States) -> tuple[list[Telling], Tensor]:
        """For each pair the difference of what they show, beside the rival's own parameters, which are refitted to what
        is measured and what will be. What is measured shows no difference: the members explain it equally well."""
        out, answered = [], torch.ones(len(states), dtype=torch.bool)
        for members in self.fits:
            asked = [pair for pair in self.names if set(pair) <= set(members)]
            there = {name: ahead(members[name], states) for name in {n for pair in asked for n in pair}}
            for one in there.values():
                answered &= one.answered
            for pair in asked:
                out.append(self._telling(known, members, there, pair))
        return out, answered

    def _telling(
        self, known: Known, members: Mapping[str, WhiteFit], there: Mapping[str, Ahead], pair: tuple[str, ...]
    ) -> Telling:
        true, rival = pair
        difference = (there[true].shown - there[rival].shown)[..., None]
        told = known.told(members[rival])
        grown = np.zeros((len(told) + 1, len(told) + 1))
        grown[:-1, :-1] = told
        return Telling(pair, torch.cat([there[rival].by_vector, difference], dim=-1), grown, 1)


@dataclass(frozen=True)
class Narrow(Goal):
    """fit: that has the parameters. labels: theirs. sizes: SI values (raw, where a logarithm is fitted: one) that they
    are thought to have, or that would be noticeable where they are not in the model yet, (q,)."""

    fit: WhiteFit | None = None
    labels: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()

    def without(self, labels: Sequence[str]) -> Narrow:
        """Without parameters that no reading depends on."""
        kept = [i for i, label in enumerate(self.labels) if label not in labels]
        return replace(self, labels=tuple(self.labels[i] for i in kept), sizes=tuple(self.sizes[i] for i in kept))

    def tellings(self, known: Known, states: States) -> tuple[list[Telling], Tensor]:
        """The parameters beside all others of the model."""
        assert self.fit is not None
        place = list(self.fit.model.labels())
        own = [place.index(label) for label in self.labels]
        order = [i for i in range(len(place)) if i not in own] + own
        size = np.ones(len(order))
        size[len(order) - len(own) :] = self.sizes
        told = known.told(self.fit)[np.ix_(order, order)] * size * size[:, None]
        there = ahead(self.fit, states)
        columns = there.by_vector[..., order] * torch.as_tensor(size)
        return [Telling(self.names[0], columns, told, len(own))], there.answered
