"""Two effects at once, where no single one helps: each alone may show only when the other is there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import torch

from freelearn.inference.bounded import bounded_least_squares
from freelearn.inference.crossval import paired
from freelearn.inference.prepare import Prepared
from freelearn.inference.rank import rank
from freelearn.inference.refit import refit, rewhitened, without
from freelearn.inference.score import EffectScore, evidence
from freelearn.inference.step import Step
from freelearn.inference.thresholds import MOST_AHEAD, PAIRS, TOGETHER
from freelearn.work import begin


def look_ahead(prepared: Prepared, step: Step, exchanging: bool = True) -> Step | None:
    """The best model with two effects more, or (exchanging) with one of those added exchanged for two; None if none
    predicts held-out states clearly better."""
    if len(prepared.question.added(step.effects)) > MOST_AHEAD:
        return None
    begin("trying two effects at once")
    fewer = prepared.question.added(step.effects) if exchanging else []
    bases = [step, *(without(prepared, step, effect) for effect in fewer)]
    found = [pair for base in bases if base is not None for pair in _pairs(prepared, base, step.left.scale)]
    better = []
    for other in found:
        gain, error = paired(other.heldout, step.heldout)
        if set(other.effects) != set(step.effects) and gain > TOGETHER * error and not other.worse(step):
            better.append(other)
    if not better:
        return None
    return rewhitened(prepared, min(better, key=lambda other: other.heldout.loss.sum()))


def _pairs(prepared: Prepared, base: Step, scale: float) -> list[Step]:
    """The base with each of the most promising pairs, fitted in full."""
    names = [name for name in prepared.question.candidates if name not in base.effects]
    scores = [s for s in rank(prepared, base, names, scale) if s.status == "tested"]
    alone: dict[str, Step | None] = {}
    out: list[Step] = []
    for one, other in promising(scores, base.fit.residual.reshape(-1), scale**2)[:PAIRS]:
        for first, second in ((one, other), (other, one)):
            if first.effect not in alone:
                alone[first.effect] = refit(prepared, base, [first])[0].get(first.effect)
            step = alone[first.effect]
            if step is None:
                continue
            both = refit(prepared, step, rank(prepared, step, [second.effect], scale))[0]
            if both:
                out += both.values()
                break
    return out


def promising(
    scores: Sequence[EffectScore], residual: torch.Tensor, variance: float
) -> list[tuple[EffectScore, EffectScore]]:
    """Pairs of effects by what both together promise of χ², the most first. residual: whitened, (2N,)."""
    parts = [s.signature for s in scores if s.signature is not None]
    if len(parts) < 2:
        return []
    columns = torch.cat(parts, dim=1)
    gram, slopes = (columns.T @ columns).numpy(), -(columns.T @ residual).numpy()
    ends = np.cumsum([0, *(part.shape[1] for part in parts)])
    low, high = (np.concatenate([getattr(s, n) for s in scores if s.signature is not None]) for n in ("low", "high"))
    promised = []
    for i, j in combinations(range(len(parts)), 2):
        own = np.r_[ends[i] : ends[i + 1], ends[j] : ends[j + 1]]
        _, gains = bounded_least_squares(gram[np.ix_(own, own)], slopes[None, own], low[own], high[own])
        promised.append((float(evidence(gains / variance, len(own))[0]), i, j))
    return [(scores[i], scores[j]) for _, i, j in sorted(promised, reverse=True)]
