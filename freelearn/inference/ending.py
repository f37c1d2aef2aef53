"""How a search ends: the answer of the sets that were looked at, and what of an answer that leaves something stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from freelearn.inference.answer import Answer, answered
from freelearn.inference.hypotheses import Hypotheses
from freelearn.inference.hypothesis import Effects, Hypothesis
from freelearn.inference.journal import ahead
from freelearn.inference.left_out import paired
from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.proposal import Proposal
from freelearn.inference.stages import Explored
from freelearn.inference.step import Step
from freelearn.inference.thresholds import BETTER, LEFT, LITTLE, MOST_KEPT, NOTHING
from freelearn.inference.white_fit import white_fit

# Sets whose held-out errors are looked at.
COMPARED = 6


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
        return self.final.left.p_value >= LEFT and self.final.fit.converged and self.final.E_heldout <= NOTHING


def ended(prepared: Prepared, known: Explored, refuted: Sequence[Effects] = ()) -> Ending:
    """The answer, and the models that it stands for. refuted: sets that are none."""
    models = Models(prepared, known)
    answer = answered(known.hypotheses, refuted)
    disagreed = models.worse(answer)
    if disagreed:
        answer = answered(known.hypotheses, [*refuted, *disagreed])
    final = models.step(answer.shown)
    classes = [{name: models.step(h) for name, h in members.items()} for members in answer.classes]
    return Ending(known, models, answer, final, classes, disagreed=disagreed)


class Models:
    """Steps of hypotheses, each made once."""

    def __init__(self, prepared: Prepared, known: Explored) -> None:
        self.prepared, self.known, self.made = prepared, known, dict[Effects, Step]()
        self.whiten = known.whiten

    def step(self, hypothesis: Hypothesis) -> Step:
        """The model, fitted to its end under the noise of measuring alone."""
        if hypothesis.key not in self.made:
            fit = hypothesis.fit
            exact = white_fit(fit.model, self.prepared.rows, self.whiten, fit.vector, fit.prior, near=fit.near)
            self.made[hypothesis.key] = self.prepared.step(exact, self.whiten)
        return self.made[hypothesis.key]

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
            if other is not best and gain > BETTER * error and self.step(other).worse(self.step(best)):
                out.append(other.key)
        return out


def standing(ending: Ending) -> Ending:
    """Of an answer that does not hold, the effects that stand on their own: each lowers the held-out error of the
    model alone, and of the model with the others, clearly, and by no little share of what stays unexplained.

    Something that is in no library can be mimicked a little by many effects that are; together they would be read as
    findings.
    """
    models, hypotheses = ending.models, ending.known.hypotheses
    shown, base = ending.answer.shown, models.step(hypotheses.found[frozenset()])
    kept = [n for n in shown.effects if _helps(base, models.step(hypotheses.joined(hypotheses.found[frozenset()], n)))]
    while True:
        now = _of(hypotheses, kept)
        step = models.step(now)
        fewer = {name: models.step(hypotheses.without(now, name)) for name in kept}
        idle = [name for name, reduced in fewer.items() if not _helps(reduced, step)]
        if not idle and len(kept) <= MOST_KEPT:
            break
        least = min(idle or kept, key=lambda name: float(fewer[name].heldout.loss.sum()))
        kept = [name for name in kept if name != least]
    by_first = {next(iter(c)): c for c in ending.classes}
    classes = [by_first.get(name, {name: step}) for name in kept]
    return replace(ending, final=step, classes=classes)


def _of(hypotheses: Hypotheses, names: Sequence[str]) -> Hypothesis:
    now = hypotheses.found[frozenset()]
    for name in names:
        now = hypotheses.joined(now, name)
    return now


def _helps(reduced: Step, step: Step) -> bool:
    gain, error = paired(step.heldout, reduced.heldout)
    unexplained = max(float(step.heldout.loss.sum()) - step.whiten.count, 0.0)
    whole = float(reduced.heldout.loss.sum() - step.heldout.loss.sum())
    return gain > BETTER * error and whole > LITTLE * unexplained and not step.worse(reduced)
