"""What all sets of effects that fit share: the answer of a search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from freelearn.inference.hypotheses import Hypotheses
from freelearn.inference.hypothesis import Effects, Hypothesis
from freelearn.inference.thresholds import FORMS, SURE, TIES, TOLD
from freelearn.models.effects.registry import EFFECTS


@dataclass(frozen=True)
class Answer:
    """shown: the smallest set that is as good as the best. classes: for each of its effects all single ones that the
    data cannot tell from it, itself first, with the set that has it instead. close: all sets that are as good, the most
    probable first, and the probability of each among all that were looked at. shares: of each effect, the probability
    of the sets that have it."""

    shown: Hypothesis
    classes: list[dict[str, Hypothesis]]
    close: list[tuple[Hypothesis, float]] = field(default_factory=list)
    shares: dict[str, float] = field(default_factory=dict)


def answered(hypotheses: Hypotheses, without: Sequence[Effects] = ()) -> Answer:
    """The answer of what was looked at. without: sets that do not count, because they predict clearly worse."""
    known = [h for h in hypotheses.ordered() if h.key not in without and math.isfinite(h.evidence)]
    # Where no evidence is finite (an accuracy of zero), or none is left, the model as it is.
    known = known or [replace(hypotheses.found[frozenset()], evidence=0.0)]
    known = sorted((believed(h, hypotheses) for h in known), key=lambda h: -h.evidence)
    weights = _weights(known)
    shown = _shown(hypotheses, known, weights)
    close = [h for h in known if h.evidence >= shown.evidence - TIES]
    shares = {
        name: sum(weights[h.key] for h in known if name in h.key) for name in {n for h in known for n in h.effects}
    }
    told = sorted(((h, weights[h.key]) for h in close), key=lambda pair: -pair[1])[:TOLD]
    classes = [_class(name, shown, close) for name in shown.effects]
    return Answer(shown, classes, told, dict(sorted(shares.items(), key=lambda pair: -pair[1])))


def believed(hypothesis: Hypothesis, hypotheses: Hypotheses) -> Hypothesis:
    """A set with what was written for it: what that explains more than the library's has to exceed what forms of the
    same thing differ by."""
    if not hypothesis.key & set(hypotheses.odds):
        return hypothesis
    explained = hypotheses.found[frozenset()].fit.chi2 - hypothesis.fit.chi2
    return replace(hypothesis, evidence=hypothesis.evidence - 0.5 * FORMS * max(explained, 0.0))


def _weights(known: Sequence[Hypothesis]) -> dict[Effects, float]:
    """Probabilities of the sets among all known."""
    most = known[0].evidence
    each = {h.key: math.exp(h.evidence - most) for h in known}
    total = sum(each.values())
    return {key: weight / total for key, weight in each.items()}


def _shown(hypotheses: Hypotheses, known: Sequence[Hypothesis], weights: dict[Effects, float]) -> Hypothesis:
    """The smallest set that is as good as the best, and of whose effects none may be missing."""
    by_key = {h.key: h for h in known}
    ties = [h for h in known if h.evidence >= known[0].evidence - TIES]
    shown = min(ties, key=lambda h: (len(h.effects), -h.evidence))
    while shown.effects:
        close = [h for h in known if h.evidence >= shown.evidence - TIES]
        doubtful = [n for n in shown.effects if _doubted(n, shown, close, weights) or _imitated(hypotheses, shown, n)]
        fewer = [by_key[shown.key - {name}] for name in doubtful if shown.key - {name} in by_key]
        if not fewer:
            break
        shown = max(fewer, key=lambda h: h.evidence)
    return shown


def _doubted(name: str, shown: Hypothesis, close: Sequence[Hypothesis], weights: dict[Effects, float]) -> bool:
    """Whether sets that have neither the effect nor what stands in for it are too probable."""
    members = set(_class(name, shown, close))
    return sum(weight for key, weight in weights.items() if not key & members) > 1 - SURE


def _class(name: str, shown: Hypothesis, close: Sequence[Hypothesis]) -> dict[str, Hypothesis]:
    """Of one effect of the set shown, what stands in for it in a set that is as good: one effect for it alone, or for
    it and others."""
    found = {name: shown}
    for other in close:
        if name not in other.key and len(other.key - shown.key) == 1 and len(other.key) <= len(shown.key):
            (instead,) = other.key - shown.key
            found.setdefault(instead, other)
    return found


def _imitated(hypotheses: Hypotheses, shown: Hypothesis, name: str) -> bool:
    """Whether the effect explains no more than other forms of the others would explain otherwise (Effect.loose)."""
    others = [other for other in shown.effects if other != name and other in EFFECTS and EFFECTS[other].loose]
    if not others:
        return False
    gains = {n: hypotheses.without(shown, n).fit.chi2 - shown.fit.chi2 for n in (name, *others)}
    return gains[name] < sum(EFFECTS[other].loose * max(gains[other], 0.0) for other in others)
