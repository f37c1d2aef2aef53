"""The answer of a search: what all sets of effects that fit share, and what stands of one that leaves something."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from scipy.special import chdtrc

from freelearn.discovery.fits.journal import ahead
from freelearn.discovery.fits.left_out import paired
from freelearn.discovery.fits.prepare import Prepared
from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.white_fit import WhiteFit, refitted
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.proposals.proposal import Proposal
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.hypothesis import Effects, Hypothesis
from freelearn.discovery.search.stages import Explored
from freelearn.discovery.thresholds import (
    FORMS,
    HOPELESS,
    INADEQUATE,
    MIN_PAIRED_Z,
    MIN_SHARE,
    MOST_KEPT,
    NOTHING,
    SURE,
    TIES,
    TOGETHER,
    TOLD,
)
from freelearn.physics.effects.registry import EFFECTS

# What all sets of effects that fit share: the answer of a search.


@dataclass(frozen=True)
class Answer:
    """shown: the smallest set that is as good as the best. classes: for each of its effects all single ones that the
    data cannot tell from it, itself first, with the set that has it instead. close: all sets that are as good, the most
    probable first, and the probability of each among all that were looked at. shares: of each effect, the probability
    of the sets that have it. beside: effects of the set shown of which other forms of the others may do as much: the
    model needs them, but they are not claimed, and have no class. imitated: those that the set shown is without for
    that."""

    shown: Hypothesis
    classes: list[dict[str, Hypothesis]]
    close: list[tuple[Hypothesis, float]] = field(default_factory=list)
    shares: dict[str, float] = field(default_factory=dict)
    doubted: list[str] = field(default_factory=list)
    beside: list[str] = field(default_factory=list)
    imitated: list[str] = field(default_factory=list)


def answered(
    hypotheses: Hypotheses,
    without: Sequence[Effects] = (),
    instead: Hypothesis | None = None,
    beside: Sequence[str] = (),
) -> Answer:
    """The answer of what was looked at. without: sets that do not count, because they predict clearly worse. instead:
    what is shown in the place of the smallest set that is as good. beside: what of it is not claimed."""
    known = [h for h in hypotheses.ordered() if h.key not in without and math.isfinite(h.evidence)]
    # Where no evidence is finite (an accuracy of zero), or none is left, the model as it is.
    known = known or [replace(hypotheses.found[frozenset()], evidence=0.0)]
    known = sorted((believed(h, hypotheses) for h in known), key=lambda h: -h.evidence)
    weights = _weights(known)
    shown, imitated = (instead, list[str]()) if instead else _shown(hypotheses, known, weights)
    close = [h for h in known if h.evidence >= shown.evidence - TIES]
    shares = {
        name: sum(weights[h.key] for h in known if name in h.key) for name in {n for h in known for n in h.effects}
    }
    told = sorted(((h, weights[h.key]) for h in close), key=lambda pair: -pair[1])[:TOLD]
    claimed = [name for name in shown.effects if name not in beside]
    classes = [_class(name, shown, close) for name in claimed]
    doubted = [name for name in claimed if _doubted(name, shown, close, weights)]
    ordered = dict(sorted(shares.items(), key=lambda pair: -pair[1]))
    return Answer(shown, classes, told, ordered, doubted, list(beside), imitated)


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


def _shown(
    hypotheses: Hypotheses, known: Sequence[Hypothesis], weights: dict[Effects, float]
) -> tuple[Hypothesis, list[str]]:
    """The smallest set that is as good as the best, and of whose effects none may be missing; and those that it is
    without only because other forms of the others may do as much."""
    by_key = {h.key: h for h in known}
    ties = [h for h in known if h.evidence >= known[0].evidence - TIES]
    unshown = set(hypotheses.question.unshown)
    # Of equal ones that which the rows can show.
    shown = min(ties, key=lambda h: (len(h.effects), len(h.key & unshown), -h.evidence))
    imitated = list[str]()
    while shown.effects:
        close = [h for h in known if h.evidence >= shown.evidence - TIES]
        doubted = [
            n
            for n in shown.effects
            if _doubted(n, shown, close, weights) or _unasked(n, shown, by_key.get(shown.key - {n}))
        ]
        doubtful = doubted + [n for n in shown.effects if n not in doubted and _imitated(hypotheses, shown, n)]
        fewer = [by_key[shown.key - {name}] for name in doubtful if shown.key - {name} in by_key]
        # Whichever it is: that nothing at all is missing may be out of the question.
        fewer = [h for h in fewer if h.effects or h.evidence > known[0].evidence - HOPELESS]
        if not fewer:
            break
        before, shown = shown, max(fewer, key=lambda h: h.evidence)
        imitated += [name for name in before.effects if name not in {*shown.effects, *doubted}]
    return shown, imitated


def _doubted(name: str, shown: Hypothesis, close: Sequence[Hypothesis], weights: dict[Effects, float]) -> bool:
    """Whether sets that have neither the effect nor what stands in for it are too probable."""
    members = set(_class(name, shown, close))
    return sum(weight for key, weight in weights.items() if not key & members) > 1 - SURE


def _unasked(name: str, shown: Hypothesis, without: Hypothesis | None) -> bool:
    """Whether the rows themselves say too little for an effect beside others: fitted with it they are missed by as much
    as without, and what speaks for it is that two usual values are more probable than a larger one. Nothing asks for
    two."""
    if without is None or not without.effects:
        return False
    count = sum(label.startswith(f"{name}.") for label in shown.fit.model.labels())
    gain = max(without.fit.chi2 - shown.fit.chi2, 0.0)
    # Of one parameter odds of 20 to 1 in the rows' likelihood, which by chance have that of two.
    return float(chdtrc(max(count, 2), gain)) > 1 - SURE


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
    gains = {n: h.fit.chi2 - shown.fit.chi2 for n, h in hypotheses.reduced(shown, (name, *others)).items()}
    return gains[name] < sum(EFFECTS[other].loose * max(gains[other], 0.0) for other in others)


# How a search ends: the answer of the sets that were looked at, and what of an answer that leaves something stands.

# Sets whose held-out errors are looked at, and such of two effects where none of them holds.
COMPARED, PAIRS_COMPARED = 6, 3


@dataclass(frozen=True)
class Ending:
    """known: all that was looked at; models: of it. final: the last model; classes: for each of its effects what the
    data cannot tell from it, itself first. disagreed: sets that the evidence holds for as good, and that predict
    clearly worse."""

    known: Explored
    models: Models
    answer: Answer
    final: Step
    classes: list[dict[str, Step]]
    proposals: list[Proposal] = field(default_factory=list)
    disagreed: list[Effects] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether nothing systematic is left."""
        return (
            not self.known.share
            and not self.final.left.shows
            and self.final.fit.converged
            and self.final.E_heldout <= NOTHING
        )


def ended(
    prepared: Prepared, known: Explored, without: Sequence[Effects] = (), instead: Hypothesis | None = None
) -> Ending:
    """The answer, and the models that it stands for. without, instead: as `answered`."""
    models = Models(prepared, known)
    answer = answered(known.hypotheses, without, instead)
    disagreed = models.worse(answer)
    if disagreed:
        kept = None if instead and instead.key in disagreed else instead
        answer = answered(known.hypotheses, [*without, *disagreed], kept)
    answer = _with_beside(models, answer, [*without, *disagreed])
    final = models.step(answer.shown)
    classes = [{name: models.step(h) for name, h in members.items()} for members in answer.classes]
    return Ending(known, models, answer, final, classes, disagreed=disagreed)


def _with_beside(models: Models, answer: Answer, without: Sequence[Effects]) -> Answer:
    """The answer with what it is without only because other forms of its effects may do as much, where something is
    left without that, and nothing with it: what else is claimed does not hang on what that is."""
    known = models.known
    whole = known.hypotheses.found.get(answer.shown.key | frozenset(answer.imitated))
    if not answer.imitated or known.share or whole is None or whole.key in without:
        return answer
    if not models.step(answer.shown).left.shows or models.step(whole).left.shows:
        return answer
    return answered(known.hypotheses, without, whole, answer.imitated)


class Models:
    """Steps of hypotheses, each made once."""

    def __init__(self, prepared: Prepared, known: Explored) -> None:
        self.prepared, self.known, self.whiten = prepared, known, known.whiten
        self.made, self.made_alone, self.made_fair = dict[Effects, Step](), dict[Effects, Step](), dict[Effects, Step]()

    def step(self, hypothesis: Hypothesis) -> Step:
        """The model, fitted to its end."""
        if hypothesis.key not in self.made:
            self.made[hypothesis.key] = self._made(hypothesis.fit, self.whiten)
        return self.made[hypothesis.key]

    def alone(self, step: Step) -> Step:
        """The same model under the noise alone, where it is told under a doubt."""
        if step.whiten.doubt is None:
            return step
        key = frozenset(step.effects)
        if key not in self.made_alone:
            self.made_alone[key] = self._made(step.fit, self.known.noise.whitener())
        return self.made_alone[key]

    def fair(self, step: Step) -> Step:
        """The same model as wrong as it is, where it is told under the noise alone and leaves more."""
        key = frozenset(step.effects)
        if key not in self.made_fair:
            whiten = self.weighing(step.fit, step.whiten)
            self.made_fair[key] = step if whiten is step.whiten else self._made(step.fit, whiten)
        return self.made_fair[key]

    def weighing(self, fit: WhiteFit, whiten: Whitener) -> Whitener:
        """How a model's readings are weighed: one that is wrong under the noise alone counts as wrong by what it
        leaves. Weighed by digits that it cannot have it would follow the few most exact readings."""
        if whiten.doubt is not None or fit.chi2 <= INADEQUATE * whiten.count:
            return whiten
        share = self.prepared.error(fit.raw_residual, whiten.slipped)
        return self.known.noise.whitener(share * self.prepared.scale, even=True)

    def _made(self, fit: WhiteFit, whiten: Whitener) -> Step:
        return self.prepared.step(refitted(fit, self.prepared.rows, whiten), whiten)

    def worse(self, answer: Answer) -> list[Effects]:
        """Sets as good as the one shown, itself included, that predict states left out clearly worse than another."""
        close = [h for h, _ in answer.close if len(h.effects) <= len(answer.shown.effects)][:COMPARED]
        if len(close) < 2:
            return []
        ahead([partial(self.step, h) for h in close])
        best = min(close, key=lambda h: float(self.step(h).heldout.loss.sum()))
        out = []
        for other in close:
            gain, error = paired(self.step(best).heldout, self.step(other).heldout)
            if other is not best and gain > MIN_PAIRED_Z * error and self.step(other).worse(self.step(best)):
                out.append(other.key)
        return out


def standing(ending: Ending) -> Ending:
    """Of an answer that does not hold, the effects that stand on their own: each lowers the held-out error of the
    model alone, and of the model with the others, clearly, and by no little share of what stays unexplained. Two that
    help only together, or that stand in no set as good as the best, do where they halve the error.

    Something that is in no library can be mimicked a little by many effects that are; together they would be read as
    findings.
    """
    models, hypotheses = ending.models, ending.known.hypotheses
    shown, nothing = ending.answer.shown, hypotheses.found[frozenset()]

    def alone(name: str) -> Step:
        return models.step(hypotheses.joined(nothing, name))

    def without(hypothesis: Hypothesis, name: str) -> Step:
        return models.step(hypotheses.without(hypothesis, name))

    ahead([partial(models.step, nothing), *(partial(alone, name) for name in shown.effects)])
    base = models.step(nothing)
    told = [name for name in shown.effects if name not in hypotheses.question.unshown]
    kept = [name for name in told if _helps(base, alone(name))]
    if len(kept) < len(told) == len(shown.effects) == 2 and models.step(shown).E_heldout <= TOGETHER * base.E_heldout:
        kept = list(told)
    while True:
        now = _of(hypotheses, kept)
        ahead([partial(models.step, now), *(partial(without, now, name) for name in kept)])
        step = models.step(now)
        fewer = {name: without(now, name) for name in kept}
        idle = [name for name, reduced in fewer.items() if not _helps(reduced, step)]
        if not idle and len(kept) <= MOST_KEPT:
            break
        least = min(idle or kept, key=lambda name: float(fewer[name].heldout.loss.sum()))
        kept = [name for name in kept if name != least]
    pairs = _pairs(hypotheses)
    ahead([job for p in pairs for job in (partial(models.step, p), *(partial(without, p, n) for n in p.effects))])
    for pair in pairs:
        other = models.step(pair)
        fewer = {name: without(pair, name) for name in pair.effects}
        if other.E_heldout <= TOGETHER * step.E_heldout and all(_helps(f, other) for f in fewer.values()):
            kept, step = list(pair.effects), other
    kept = _falling(models, hypotheses, kept)
    step = models.fair(models.step(_of(hypotheses, kept)))
    by_first = {next(iter(c)): c for c in ending.classes}
    classes = [by_first.get(name, {name: step}) for name in kept]
    return replace(ending, final=step, classes=classes)


def _pairs(hypotheses: Hypotheses) -> list[Hypothesis]:
    """The most probable sets of as many of the library's effects as an unexplained model keeps."""
    others = {*hypotheses.odds, *hypotheses.question.unshown}
    sets = [h for h in hypotheses.ordered() if len(h.effects) == MOST_KEPT and not h.key & others]
    return sets[:PAIRS_COMPARED]


def _of(hypotheses: Hypotheses, names: Sequence[str]) -> Hypothesis:
    now = hypotheses.found[frozenset()]
    for name in names:
        now = hypotheses.joined(now, name)
    return now


def _helps(reduced: Step, step: Step) -> bool:
    gain, error = paired(step.heldout, reduced.heldout)
    unexplained = max(float(step.heldout.loss.sum()) - step.whiten.expected, 0.0)
    whole = float(reduced.heldout.loss.sum() - step.heldout.loss.sum())
    return gain > MIN_PAIRED_Z * error and whole > MIN_SHARE * unexplained and not step.worse(reduced)


def _falling(models: Models, hypotheses: Hypotheses, kept: Sequence[str]) -> list[str]:
    """Of the effects that are kept those with which the error falls that is told, of models as wrong as they are."""

    def told(hypothesis: Hypothesis) -> float:
        return models.fair(models.step(hypothesis)).E_heldout

    while kept:
        now = _of(hypotheses, kept)
        fewer = {name: hypotheses.without(now, name) for name in kept}
        ahead([partial(told, h) for h in (now, *fewer.values())])
        least = min(kept, key=lambda name: told(fewer[name]))
        if told(now) < told(fewer[least]):
            break
        kept = [name for name in kept if name != least]
    return list(kept)
