"""What a plan is for, and what rows are expected to tell, a plan's or a user's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.states import States, kinematic_state
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.queries.next_measurements.known_rows import Ahead, Known, ahead, standing
from freelearn.queries.next_measurements.views import InformationMatrix, refitted, remaining, value

# What a plan is for: to discriminate effects that look alike, to detect whether one is there, to narrow a parameter.

DISCRIMINATE, DETECT, NARROW = "discriminate", "detect", "narrow"
# Standard deviations by which a difference counts as told: chance then leaves it undecided in one of fifty cases.
SURE = 5.0


@dataclass(frozen=True)
class Contrast:
    """One thing that rows tell. columns: (n, 2, k) derivatives of what the rows show, SI, by coefficients that are
    refitted and then by those of interest, which are one where the thing is as large as it is thought to be. known:
    (k, k), what is told already."""

    name: tuple[str, ...]
    columns: Tensor
    known: np.ndarray
    interest: int


@dataclass(frozen=True)
class Goal:
    """kind: discriminate, detect or narrow. names: the pairs of effects (that which is there, and its rival), the
    effect or the
    parameter."""

    kind: str
    names: tuple[tuple[str, ...], ...]

    def contrasts(self, known: Known, states: States) -> tuple[list[Contrast], Tensor]:
        """What rows at n states tell, and which of them have an answer, (n,) bool."""
        raise NotImplementedError


@dataclass(frozen=True)
class Discriminate(Goal):
    """fits: of every member of every class, by class and effect."""

    fits: Sequence[Mapping[str, WhiteFit]] = ()

    @classmethod
    def from_fits(cls, fits: Sequence[Mapping[str, WhiteFit]]) -> Discriminate:
        """Every member against every other of its class, whichever of them is there."""
        return cls(DISCRIMINATE, tuple(pair for members in fits for pair in permutations(members, 2)), fits)

    def without(self, pairs: Sequence[tuple[str, ...]]) -> Discriminate:
        """Without pairs that cannot be told."""
        return Discriminate(DISCRIMINATE, tuple(pair for pair in self.names if pair not in pairs), self.fits)

    def contrasts(self, known: Known, states: States) -> tuple[list[Contrast], Tensor]:
        """For each pair the difference of what they show, beside the rival's own parameters, which are refitted to what
        is measured and what will be. What is measured shows no difference: the members explain it equally well."""
        out, answered = [], torch.ones(len(states), dtype=torch.bool)
        for members in self.fits:
            asked = [pair for pair in self.names if set(pair) <= set(members)]
            there = {name: ahead(members[name], states) for name in {n for pair in asked for n in pair}}
            for one in there.values():
                answered &= one.answered
            for pair in asked:
                out.append(self._contrast(known, members, there, pair))
        return out, answered

    def _contrast(
        self, known: Known, members: Mapping[str, WhiteFit], there: Mapping[str, Ahead], pair: tuple[str, ...]
    ) -> Contrast:
        true, rival = pair
        difference = (there[true].shown - there[rival].shown)[..., None]
        informed = known.information(members[rival])
        grown = np.zeros((len(informed) + 1, len(informed) + 1))
        grown[:-1, :-1] = informed
        return Contrast(pair, torch.cat([there[rival].by_vector, difference], dim=-1), grown, 1)


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

    def contrasts(self, known: Known, states: States) -> tuple[list[Contrast], Tensor]:
        """The parameters beside all others of the model."""
        assert self.fit is not None
        place = list(self.fit.model.labels())
        own = [place.index(label) for label in self.labels]
        order = [i for i in range(len(place)) if i not in own] + own
        size = np.ones(len(order))
        size[len(order) - len(own) :] = self.sizes
        informed = known.information(self.fit)[np.ix_(order, order)] * size * size[:, None]
        there = ahead(self.fit, states)
        columns = there.by_vector[..., order] * torch.as_tensor(size)
        return [Contrast(self.names[0], columns, informed, len(own))], there.answered


# What rows are expected to tell, a plan's or a user's own: from their table alone, so that both are judged alike.


@dataclass(frozen=True)
class InformationGain:
    """One thing that rows tell, in σ. name: what. before: by what is measured; after: with the rows. gain, and prior:
    what the rows add to the criterion and what it was before (InformationMatrix). errors_before, errors_after: standard
    errors of the coefficients of interest, (q,), in their own unit. shares: σ that every row adds, (n,), squares of
    which add up."""

    name: tuple[str, ...]
    before: float
    after: float
    prior: float
    gain: float
    errors_before: np.ndarray
    errors_after: np.ndarray
    shares: np.ndarray


@dataclass(frozen=True)
class Score:
    """gains: of every contrast. answered: (n,) bool, rows of which all models have an answer; the others tell
    nothing."""

    gains: list[InformationGain]
    answered: np.ndarray

    @property
    def weakest(self) -> InformationGain:
        """What is told least."""
        return min(self.gains, key=lambda one: one.gain)


def score(known: Known, goal: Goal, table: pd.DataFrame) -> Score:
    """Of a table's rows, in the order in which they would be measured."""
    states = standing(States.from_table(table), known.rows.states)
    contrasts, answered = goal.contrasts(known, states)
    whiten = known.noise(states, torch.as_tensor(kinematic_state(table)))
    gains = []
    for contrast in contrasts:
        heard = torch.where(answered[:, None, None], contrast.columns, 0.0)
        columns = whiten(heard).numpy()
        view = InformationMatrix.scaled(contrast.name, columns[:, None], contrast.known, contrast.interest)
        flat = view.columns.reshape(-1, view.columns.shape[-1])
        total = view.known + flat.T @ flat
        direction = refitted(total, view.interest).sum(1)
        shares = np.sqrt(np.square(view.columns[:, 0] @ direction).sum(1))
        left = [remaining(m, view.interest) for m in (view.known, total)]
        prior, now = (float(value(m, view.interest)) for m in (view.known, total))
        before, after = (max(float(m.sum()), 0.0) ** 0.5 for m in left)
        # What refitting to the rows costs in what was measured before is theirs too.
        shares *= (max(after**2 - before**2, 0.0) / max(float(np.square(shares).sum()), 1e-300)) ** 0.5
        errors = [np.sqrt(np.diagonal(np.linalg.pinv(m, hermitian=True)).clip(0)) for m in left]
        gains.append(InformationGain(contrast.name, before, after, prior, now - prior, errors[0], errors[1], shares))
    return Score(gains, answered.numpy())
