"""Sets of effects, looked at best first: adding, taking out and exchanging, and pairs where single effects do not help.

What can be claimed is what all sets that fit share; so every set that is looked at is kept, with its fit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import torch
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.data.warm_start import Near
from freelearn.discovery.fits.derivatives import none_vector
from freelearn.discovery.fits.journal import together
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.white_fit import SentFit, WhiteFit, WhiteProblem, white_fit
from freelearn.discovery.noise.linear_algebra import left_over
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.search.hypothesis import Effects, Hypothesis, log_evidence, log_odds
from freelearn.discovery.search.pairs import Pair, Pairs
from freelearn.discovery.search.ranking import Promise, Ranking
from freelearn.discovery.thresholds import (
    ALMOST,
    BEAM,
    CHILDREN,
    COMPARABLE,
    HOPEFUL,
    HOPELESS,
    MOST_EFFECTS,
    MOST_EXPANDED,
    NEEDED,
    PAIRS,
    TIES,
)
from freelearn.fitting.starts import DEAD_TIME, with_delay
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS

# Times that the way to a start is halved, and how many of these ends are looked at at once.
HALVINGS, TOGETHER = 12, 4


@dataclass(frozen=True)
class Asked:
    """A set that is to be fitted, from a raw start (p,). like: a fit whose equilibria lie near. rival: χ² that it has
    to come near to be of any interest. still, base: where what it has more than a base does nothing, (p,), and that;
    the start is drawn in to there where it is worse."""

    effects: Sequence[str]
    start: Tensor
    like: WhiteFit | None = None
    rival: float | None = None
    still: Tensor | None = None
    base: Hypothesis | None = None

    @property
    def key(self) -> Effects:
        """The effects, whatever their order."""
        return frozenset(self.effects)


@dataclass
class Hypotheses:
    """All sets that were looked at on some rows under one noise.

    odds: of effects that are in no library. about: the place from which every evaluation is one step (hang.held_about);
    None where equilibria are searched for. expanded, exchanged: the sets whose neighbors were looked at, and those with
    the effects of theirs in whose place others were; ranked, pairs: what was promised on top of them, by one and by two
    effects."""

    question: Question
    rows: Rows
    whiten: Whitener
    spans: Mapping[str, float]
    odds: dict[str, float] = field(default_factory=dict)
    about: Near | None = None
    found: dict[Effects, Hypothesis] = field(default_factory=dict)
    expanded: set[Effects] = field(default_factory=set)
    exchanged: set[tuple[Effects, str]] = field(default_factory=set)
    ranked: dict[Effects, list[Promise]] = field(default_factory=dict)
    pairs: dict[Effects, Pairs] = field(default_factory=dict)

    @property
    def library(self) -> list[str]:
        """The effects to try, those that were written last."""
        return [*self.question.candidates, *self.question.unshown, *self.odds]

    @property
    def best(self) -> Hypothesis:
        """The most probable one."""
        return max(self.found.values(), key=lambda h: h.evidence)

    def ordered(self) -> list[Hypothesis]:
        """All, the most probable first."""
        return sorted(self.found.values(), key=lambda h: -h.evidence)

    def build(self, effects: Sequence[str]) -> Model:
        """A fresh model with the question's own effects and these."""
        return self.question.build([*self.question.given, *effects])

    def under(self, whiten: Whitener, rows: Rows, kept: Sequence[Hypothesis], about: Near | None = None) -> Hypotheses:
        """The same question under another noise, or on other rows, with some of the sets fitted anew."""
        other = Hypotheses(self.question, rows, whiten, self.spans, self.odds, about)
        nothing = self.found[frozenset()]
        other.fits(Asked(h.effects, h.fit.vector, h.fit) for h in [nothing, *(h for h in kept if h is not nothing)])
        return other

    def worth_keeping(self, most: int) -> list[Hypothesis]:
        """The most probable sets that are not hopelessly behind the best."""
        return [h for h in self.ordered()[:most] if h.evidence > self.best.evidence - HOPELESS]

    def fit(self, effects: Sequence[str], start: Tensor, like: WhiteFit | None = None) -> Hypothesis:
        """The set with its most probable parameters, from a raw start (p,); known already where it was looked at.

        like: a fit whose equilibria lie near."""
        asked = Asked(effects, start, like)
        if asked.key not in self.found:
            self._keep(asked, self._fitted(asked))
        return self.found[asked.key]

    def fits(self, asked: Iterable[Asked]) -> None:
        """As many at once, side by side; of those of one set the first counts."""
        new: dict[Effects, Asked] = {}
        for each in asked:
            if each.key not in self.found:
                new.setdefault(each.key, each)
        sent = together([partial(self._sent, each) for each in new.values()])
        for each, fit in zip(new.values(), sent, strict=True):
            model = self.build(self._ordered(each.effects))
            self._keep(each, fit.received(model, self.question.prior(model, self.spans)))

    def _sent(self, asked: Asked) -> SentFit:
        return SentFit.from_fit(self._fitted(asked))

    def _fitted(self, asked: Asked) -> WhiteFit:
        names = self._ordered(asked.effects)
        model = self.build(names)
        prior = self.question.prior(model, self.spans)
        start = asked.start
        if asked.still is not None and asked.base is not None:
            start = self._sound(names, asked.still, start, asked.base)
            if DEAD_TIME not in asked.base.effects:
                start = with_delay(model, self.rows, start)
        near = self.about or (asked.like.begin if asked.like else None)
        return white_fit(model, self.rows, self.whiten, start, prior, roughly=True, rival=asked.rival, near=near)

    def _keep(self, asked: Asked, fit: WhiteFit) -> None:
        names = self._ordered(asked.effects)
        # A fit that ended at a kink says no more than that it is at least so good.
        known = bool(fit.residual.isfinite().all()) and bool(fit.jacobian.isfinite().all())
        evidence = log_evidence(fit, names) + log_odds(names, self.odds) if known else -torch.inf
        self.found[asked.key] = Hypothesis(names, fit, evidence)

    def _ordered(self, effects: Collection[str]) -> tuple[str, ...]:
        return tuple(name for name in self.library if name in effects)

    def explore(
        self,
        watch: Callable[[Hypothesis], None] = lambda h: None,
        beam: int = BEAM,
        most: int = MOST_EXPANDED,
        rivals: int = 1,
        instead: Collection[str] | None = None,
    ) -> Hypothesis:
        """Looks at the neighbors of the most probable sets, so many, until none of these is new; the best one. most:
        rounds of it. rivals: of how many sets that are as good others are looked at in the place of their effects;
        instead: which, all by default."""
        for _ in range(most):
            front = [h for h in self.ordered()[:beam] if h.key not in self.expanded]
            if not front:
                if not self._exchanged(rivals, instead):
                    break
                continue
            before = self.best
            self.expand(front[0])
            if self.best is not before:
                watch(self.best)
        return self.best

    def descend(self, effects: Sequence[str]) -> Hypothesis:
        """From a set to the most probable of its neighbors, again and again, until none is more probable."""
        now = self.joined(self.found[frozenset()], *effects)
        while True:
            if now.key not in self.expanded:
                self.expand(now)
            next_to = max((h for h in self.found.values() if len(h.key ^ now.key) == 1), key=lambda h: h.evidence)
            if next_to.evidence <= now.evidence:
                return now
            now = next_to

    def expand(self, hypothesis: Hypothesis) -> None:
        """Looks at the set's neighbors: one effect more, one less, two more where no single one promises anything."""
        self.expanded.add(hypothesis.key)
        fewer = [self._less(hypothesis, name) for name in _spare(hypothesis) if not needed(hypothesis, name)]
        if len(hypothesis.effects) >= MOST_EFFECTS:
            self.fits(fewer)
            return
        self.rank(hypothesis)
        hopeful = self._hopeful(self.ranked[hypothesis.key])
        self.fits([*fewer, *(self._more(hypothesis, promise) for promise in hopeful)])
        single = max((p.evidence for p in hopeful), default=0.0)
        if hypothesis is self.best and len(hypothesis.effects) + 2 <= MOST_EFFECTS:
            pairs = self.pairs[hypothesis.key].best(PAIRS)
            self.fits(self._two(hypothesis, pair) for pair in pairs if pair.evidence > max(single, 0.0) + 1.0)

    @staticmethod
    def _hopeful(promised: Sequence[Promise]) -> list[Promise]:
        """The promises that are worth a fit, the best first: not those far behind the best."""
        tested = [p for p in promised if p.status == "tested" and p.evidence > HOPEFUL]
        return [p for p in tested if p.evidence > tested[0].evidence - HOPELESS][:CHILDREN]

    def rank(self, hypothesis: Hypothesis) -> Ranking:
        """What the effects that the set lacks promise on top of it."""
        given = self.question.given
        present = {"", *given, *hypothesis.effects}
        others = [name for name in self.library if name not in present and EFFECTS[name].beside in present]
        ranking = Ranking(
            hypothesis.fit, self.rows, self.whiten, others, self.question.on([*given, *hypothesis.effects]),
            self.spans, self.question.priors, self.odds,
        )  # fmt: skip
        self.ranked[hypothesis.key], self.pairs[hypothesis.key] = ranking.promises(), ranking.pairs
        return ranking

    def _more(self, hypothesis: Hypothesis, promise: Promise) -> Asked:
        """The set with one effect more, to be fitted."""
        assert promise.start is not None
        assert promise.still is not None
        return self._beside(hypothesis, [promise.effect], promise.start, promise.still)

    def without(self, hypothesis: Hypothesis, name: str) -> Hypothesis:
        """The set with one effect less."""
        return self.reduced(hypothesis, [name])[name]

    def reduced(self, hypothesis: Hypothesis, names: Iterable[str]) -> dict[str, Hypothesis]:
        """The set without each of some of its effects, by that effect."""
        fewer = {name: self._less(hypothesis, name) for name in names}
        self.fits(fewer.values())
        return {name: self.found[asked.key] for name, asked in fewer.items()}

    def _less(self, hypothesis: Hypothesis, name: str) -> Asked:
        names = [n for n in hypothesis.effects if n != name]
        known = dict(zip(hypothesis.fit.model.labels(), hypothesis.fit.vector, strict=True))
        return Asked(names, torch.stack([known[label] for label in self.build(names).labels()]), hypothesis.fit)

    def joined(self, hypothesis: Hypothesis, *more: str) -> Hypothesis:
        """The set with one or more effects more, from where these do nothing."""
        names = (*hypothesis.effects, *more)
        known = self.found.get(frozenset(names))
        return known or self.fit(names, none_vector(self.build(names), hypothesis.fit), hypothesis.fit)

    def _two(self, hypothesis: Hypothesis, pair: Pair) -> Asked:
        """The set with two effects more, to be fitted."""
        model, known = self.build((*hypothesis.effects, *pair.names)), dict[str, Tensor]()
        for promise in self.ranked[hypothesis.key]:
            if promise.effect in pair.names:
                assert promise.still is not None
                labels = self.build((*hypothesis.effects, promise.effect)).labels()
                known |= zip(labels, promise.still, strict=True)
        still = torch.stack([known[label] for label in model.labels()])
        start = still + still.new_tensor([pair.moved.get(label, 0.0) for label in model.labels()])
        return self._beside(hypothesis, pair.names, start.clamp(*model.raw_bounds()), still)

    def _beside(self, hypothesis: Hypothesis, more: Sequence[str], start: Tensor, still: Tensor) -> Asked:
        """The set with effects more, to be fitted. Its rivals are those known now, whatever is fitted beside it."""
        rival = min(h.fit.chi2 for h in (hypothesis, self.best))
        return Asked((*hypothesis.effects, *more), start, hypothesis.fit, rival, still, hypothesis)

    def _exchanged(self, rivals: int, instead: Collection[str] | None) -> bool:
        """Whether what could stand in for an effect of the best set, or for one that all sets have which are as good,
        has not been looked at, and has been now."""
        best = self.best
        tied = [h for h in self.ordered()[:rivals] if h.evidence > best.evidence - TIES]
        shared = frozenset[str].intersection(*(h.key for h in tied))
        for hypothesis in tied:
            names = [n for n in _spare(hypothesis) if hypothesis is best or n in shared]
            names = [n for n in names if (hypothesis.key, n) not in self.exchanged]
            if names:
                self._exchange(hypothesis, names, instead)
                return True
        return False

    def _exchange(self, whole: Hypothesis, names: Sequence[str], instead: Collection[str] | None) -> None:
        """Looks at what could stand in for these effects of a set, one or two for each, what promises most first, until
        a set is clearly better: what could stand in for effects of that one is asked then."""
        self.exchanged |= {(whole.key, name) for name in names}
        reduced = self.reduced(whole, names)
        unknown = [h for h in reduced.values() if h.key not in self.ranked]
        for hypothesis, promised in zip(unknown, together([partial(self._promised, h) for h in unknown]), strict=True):
            self.ranked[hypothesis.key], self.pairs[hypothesis.key] = promised
        before = self.best
        asked = [each for name, base in reduced.items() for each in self._stand_ins(whole, name, base, instead)]
        asked.sort(key=lambda each: -each[0])
        for first in range(0, len(asked), CHILDREN):
            self.fits(each for _, each in asked[first : first + CHILDREN])
            if self.best.evidence > before.evidence + TIES:
                break

    def _stand_ins(
        self, whole: Hypothesis, name: str, base: Hypothesis, instead: Collection[str] | None
    ) -> list[tuple[float, Asked]]:
        """Of the sets with one or two others in the place of an effect those that are worth a fit, with the evidence
        that they promise. base: the whole set without the effect."""
        tested = [p for p in self.ranked[base.key] if p.status == "tested"]
        alone = {p.effect: p.evidence for p in tested}
        own = alone.get(name, 0.0)
        # What is linear is off about the effect itself by what that gave; it may be about the others by as much,
        # and the other way.
        off = abs(whole.evidence - base.evidence - own)
        far = off > COMPARABLE
        allowed = [p for p in tested if p.effect != name and (instead is None or p.effect in instead)]
        least = own - max(2 * off if far else COMPARABLE, (1 - ALMOST) * own)
        rivals = [p for p in allowed if p.evidence > least][:CHILDREN]
        found = [(base.evidence + p.evidence, self._more(base, p)) for p in rivals]
        # What is off by more says little of two.
        if len(whole.effects) == MOST_EFFECTS or far:
            return found
        barred = set(alone) - {p.effect for p in allowed}
        for pair in self.pairs[base.key].best(PAIRS, barred):
            # Two of which one alone promises nearly as much are looked at beside that one.
            if pair.evidence > max(own - TIES, *(alone[each] + 1.0 for each in pair.names)):
                found.append((base.evidence + pair.evidence, self._two(base, pair)))
        return found

    def _promised(self, hypothesis: Hypothesis) -> tuple[list[Promise], Pairs]:
        self.rank(hypothesis)
        return self.ranked[hypothesis.key], self.pairs[hypothesis.key]

    def _sound(self, names: Sequence[str], still: Tensor, start: Tensor, base: Hypothesis) -> Tensor:
        """The start (p,), or as much of the way to it from where the effect does nothing as does not raise χ².

        What a linear effect promises may lie far beyond where it is linear: where no row has an equilibrium, perhaps.
        """
        problem = WhiteProblem(self.build(names), self.rows, self.whiten, near=base.fit.near)
        shares = 0.5 ** torch.arange(HALVINGS, dtype=start.dtype)
        with torch.no_grad():
            # Several in one batch cost little more than one.
            for some in shares.split(TOGETHER):
                nearer: Tensor = still + some[:, None] * (start - still)
                chi2 = problem.residuals(nearer).square().sum(1)
                sound = torch.nonzero(chi2 <= base.fit.chi2 * (1 + 1e-9))
                if len(sound):
                    return nearer[int(sound[0])]
        return still


def _spare(hypothesis: Hypothesis) -> list[str]:
    """The set's effects of which no other is a further term."""
    taken = {EFFECTS[name].beside for name in hypothesis.effects}
    return [name for name in hypothesis.effects if name not in taken]


def needed(hypothesis: Hypothesis, name: str) -> bool:
    """Whether a set without one of its effects is hopelessly less probable, to first order: then it is not fitted.

    The sum of squares is taken for quadratic about the fit, the other parameters giving way to the effect's being none.
    """
    fit = hypothesis.fit
    labels, declared = fit.model.labels(), fit.model.declared
    own = [i for i, label in enumerate(labels) if label.startswith(f"{name}.")]
    others = [i for i in range(len(labels)) if i not in own]
    # What is undefined without the effect (a time constant) goes with it.
    gone = {i: p.none for i in own if (p := declared.get(labels[i])) is not None and p.none is not None}
    none = [declared[labels[i]].to_raw(value) for i, value in gone.items()]
    step = torch.tensor(none, dtype=torch.float64) - fit.vector[list(gone)]
    if not gone or not bool(step.isfinite().all()) or not bool(fit.jacobian.isfinite().all()):
        return False
    root = fit.information_root()
    return 0.5 * float(left_over(root[:, list(gone)] @ step, root[:, others]).square().sum()) > NEEDED
