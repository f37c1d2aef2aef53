"""Which effects is a model missing? All sets of effects that fit, and what they share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from freelearn.common.formats import error_in_words
from freelearn.common.progress import begin
from freelearn.data.rows import Rows
from freelearn.discovery.fits.journal import ahead, kept
from freelearn.discovery.fits.prepare import Prepared, Question, prepare, without
from freelearn.discovery.fits.step import Candidate, Step
from freelearn.discovery.fits.white_fit import WhiteFit, refitted
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.proposals.proposal import Proposal
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, ROWS_SHOW, Case, Check
from freelearn.discovery.referee.referee import CLAIMS, Referee, refereed
from freelearn.discovery.residuals.slipped_blocks import Block, blocks
from freelearn.discovery.residuals.suspects import Suspect, state_outliers, suspects
from freelearn.discovery.search.answer import Answer, Ending, ended, standing
from freelearn.discovery.search.beyond import asked_beyond, beyond
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.hypothesis import Hypothesis, minimal
from freelearn.discovery.search.measuring_order import DRIFT, confounded, in_order_of
from freelearn.discovery.search.ranking import Promise
from freelearn.discovery.search.set_pressures import at_levels
from freelearn.discovery.search.stability import stability
from freelearn.discovery.search.stages import explored
from freelearn.discovery.search.testable import scant
from freelearn.discovery.search.throughout import throughout
from freelearn.discovery.thresholds import EVEN, IDLE, MODELS_TOLD, MOST_ALIKE, MOST_KEPT, OUTWEIGHED, RISES

# Told of each new step and what it is.
Watch = Callable[[Step, str], None]
# Candidates whose held-out errors are told.
SHOWN = 5
# Sets that the next measurement of an undecided table has to split, and what one without effects is called.
TOLD_RIVALS, NO_EFFECT = 3, "no effect"
# The most probable sets that are asked what they predict, where nothing is claimed.
HINTS = 4
# Sets that the referee is asked about beside the one shown, where that does not stand.
ASKED_AGAIN = 2
# For one effect, all that the data cannot tell from it, itself first, each with the fit of the whole model.
EquivalenceClass = dict[str, Step]


@dataclass(frozen=True)
class ToldModel:
    """A set of effects that fits as well as the best. E_heldout: a fraction; evidence: logarithm of its probability up
    to a constant; parameters: by label, SI; probability: among all sets that were looked at."""

    effects: list[str]
    E_heldout: float
    evidence: float
    parameters: dict[str, float]
    probability: float


@dataclass(frozen=True)
class Findings:
    """What a search ends with.

    verdict: adequate, named, class, proposed, unexplained or undecided; claimed: the same before the referee. effects:
    those that were missing, in the order in which they lower the error most, without those given. classes: for each of
    them all that the data cannot tell from it, itself first, with its fit. steps: the models on the way, the first with
    the given effects alone. rows: those with an answer; kept: which of the question's rows these are. noise_floor: the
    error of a perfect model, a fraction. suspects: readings that slipped, perhaps. sorted_by: inputs of which, for the
    order of measuring, an unknown function would explain as much as the drift that was found. proposals: effects that
    the search wrote itself; where it stays unexplained, the best part of an answer, which the last model does not have.
    answer: all sets that are as good, and the probability of each effect; models: the same with their errors. cosines:
    how alike the traces of effects are, see Ranking.cosines. referee: the checks of what would be claimed. rivals: of a
    table that cannot tell, the most probable sets, by their effects: what to measure has to split them. asked: the
    effects of the model that the referee was asked of, where the last one has not all of them."""

    verdict: str
    effects: list[str]
    classes: list[EquivalenceClass]
    steps: list[Step]
    rows: Rows
    kept: np.ndarray
    noise_floor: float
    suspects: list[Suspect] = field(default_factory=list)
    sorted_by: list[str] = field(default_factory=list)
    proposals: list[Proposal] = field(default_factory=list)
    answer: Answer | None = None
    cosines: tuple[list[str], np.ndarray] = field(default_factory=lambda: ([], np.zeros((0, 0))))
    referee: Referee | None = None
    models: list[ToldModel] = field(default_factory=list)
    claimed: str = ""
    rivals: dict[str, Step] = field(default_factory=dict)
    predicts_best: ToldModel | None = None
    asked: list[str] = field(default_factory=list)

    @property
    def final(self) -> Step:
        """The last model."""
        return self.steps[-1]


def search(question: Question, watch: Watch | None = None, reason: Check | None = None) -> Findings:
    """Looks at sets of effects, and tells what all of them share that fit. reason: why the rows can tell nothing, where
    that is known already.

    Inside a journal (see `kept_in`) it goes on from where an interrupted search of the same question was.
    """
    begin("fitting the model as it is, and how its readings scatter")
    watch = watch or (lambda step, text: None)
    if (reason := reason or scant(question)) is not None:
        return _untold(question, reason, watch)
    with kept(), ExitStack() as stack:
        prepared, fit, noise = prepare(question)
        if (as_set := at_levels(prepared, fit, noise)) is not None:
            prepared, fit, noise = prepare(as_set)
        known = explored(prepared, fit, noise, _so_far)
        ending = ended(prepared, known)
        asked = not _unshown_in(prepared, ending) and asked_beyond(prepared, known, ending)
        # Readings that slipped together are no function of anything.
        if asked and not slipped_together(prepared, ending.models.alone(ending.final))[0]:
            ending = beyond(prepared, known, ending, stack)
        return _findings(prepared, ending, watch)


def _untold(question: Question, reason: Check, watch: Watch) -> Findings:
    """Of rows that can tell nothing: the model as it is."""
    prepared, fit, noise = prepare(question)
    step = prepared.step(fit, noise.whitener())
    watch(step, "base model")
    return Findings(
        "undecided", [], [], [step], prepared.rows, prepared.kept, step.floor, referee=Referee([reason]),
        claimed="undecided",
    )  # fmt: skip


def _so_far(best: Hypothesis) -> None:
    begin(f"best so far: {' + '.join(best.effects) or 'the model alone'}")


def _findings(prepared: Prepared, ending: Ending, watch: Watch) -> Findings:
    """What the search ended with, readings that slipped, what the referee says of it, and all."""
    together, ending = _put_right(prepared, ending)
    sorted_by = confounded(prepared, ending.final)
    begin("asking whether the claim stands")
    referee = looked_at(prepared, ending)
    claimed = verdict(ending, sorted_by)
    if not referee.stands and claimed in CLAIMS and ending.final is ending.models.step(ending.answer.shown):
        other = _next_best(prepared, ending)
        if other is not None:
            ending, referee = other
            sorted_by = confounded(prepared, ending.final)
            claimed = verdict(ending, sorted_by)
    claim = decided(claimed, referee, ending.answer)
    asked = prepared.question.added(ending.final.effects)
    # What blocks of slipped readings explain is settled already; beside many effects they may only mend what is left.
    if claim == "unexplained" and (not together or len(asked) > MOST_KEPT):
        before, ending = ending, standing(ending)
        if ending.final is not before.final:
            # Of what does not stand, some may only have mended blocks.
            together, ending = _put_right(prepared, ending)
    hypotheses = ending.known.hypotheses
    # What these rows cannot show is listed as that, with the reason.
    testable = replace(hypotheses, question=replace(prepared.question, unshown={}))
    ranking = testable.rank(hypotheses.found[frozenset()])
    steps = staircase(prepared, ending)
    final, rows, kept = steps[-1], prepared.rows, prepared.kept
    tried = candidates(prepared, hypotheses, ranking.promises(), final.whiten)
    steps = [steps[0].tried(tried), *steps[1:]]
    for number, step in enumerate(steps):
        added = [e for e in step.effects if not number or e not in steps[number - 1].effects]
        watch(step, f"added {', '.join(added)}" if number else "base model")
    ordered = in_order_of(rows.states) if together else []
    pointed_out = [block.suspect(rows, kept, ordered) for block in together] + suspects(final, rows, kept)
    if not together:
        pointed_out += state_outliers(final, rows, kept, lacking=final.left.shows)
    effects = [e for e in prepared.question.added(final.effects) if e not in ending.answer.beside]
    order = list(dict.fromkeys(name for step in steps for name in step.effects if name in effects))
    # Of what was written only what is in the answer has a file; its other forms are told as its twins.
    known = [n for c in ending.classes for n in c if n in effects or n not in hypotheses.odds]
    classes = [{n: step for n, step in c.items() if n in known} for c in ending.classes]
    classes = sorted(classes, key=lambda c: order.index(next(iter(c))))
    return Findings(
        claim, order, classes, steps, rows, kept, final.floor, pointed_out, sorted_by if DRIFT in order else [],
        ending.proposals, ending.answer, ranking.cosines(), referee, told_models(ending), claimed,
        rivals(ending) if claim == "undecided" else {}, None if claim in CLAIMS else predicts_best(ending),
        [] if set(asked) == set(prepared.question.added(final.effects)) else asked,
    )  # fmt: skip


def _put_right(prepared: Prepared, ending: Ending) -> tuple[list[Block], Ending]:
    """Blocks of readings that slipped together, and the ending without what only mended what they explain: no class of
    the answer is left of that."""
    exact = ending.models.alone(ending.final)
    together, final = slipped_together(prepared, exact)
    if not together and final is exact:
        return together, ending
    classes = [c for c in ending.classes if DRIFT not in c and next(iter(c)) in final.effects]
    return together, replace(ending, final=final, classes=classes)


def rivals(ending: Ending) -> dict[str, Step]:
    """The most probable sets of effects, by name, the one shown first."""
    shown = ending.answer.shown
    others = [h for h in ending.known.hypotheses.ordered() if h.key != shown.key and math.isfinite(h.evidence)]
    found = {}
    for hypothesis in [shown, *others][:TOLD_RIVALS]:
        step = ending.models.step(hypothesis)
        if step.fit.proper:
            found[" and ".join(hypothesis.effects) or NO_EFFECT] = step
    return found


def _next_best(prepared: Prepared, ending: Ending) -> tuple[Ending, Referee] | None:
    """Of the sets that are as good as the one that the referee does not let stand, or else fit and predict no worse,
    the one that predicts best of those that he does, and what he says of it; None where no such set stands. Whether it
    may be claimed, the others decide as before, the one that does not stand among them."""
    if ending.proposals:
        return None
    shown, unshown = ending.answer.shown, set(prepared.question.unshown)
    # The one shown does not stand: that it is a part of another, and more probable, says nothing against that.
    others = [h for h in ending.known.hypotheses.ordered() if h.effects and h.key != shown.key and not h.key & unshown]
    told = {h.key for h, _ in ending.answer.close}
    close = minimal([h for h in others if h.key in told])
    # An effect more always fits better.
    other = [h for h in others if h.key not in told and not h.key > shown.key and h.fit.chi2 < shown.fit.chi2 + 1]
    after = minimal([h for h in other if h.evidence >= shown.evidence - OUTWEIGHED])
    ahead([partial(ending.models.step, h) for h in [*close, *after]])

    def predicts(hypothesis: Hypothesis) -> float:
        return ending.models.step(hypothesis).E_heldout

    no_worse = [h for h in after if not ending.models.step(h).worse(ending.models.step(shown))]
    asked = [*sorted(close, key=predicts)[:ASKED_AGAIN], *sorted(no_worse, key=predicts)[:ASKED_AGAIN]]
    for hypothesis in asked:
        now = ended(prepared, ending.known, ending.disagreed, hypothesis)
        if now.answer.shown is not hypothesis or verdict(now) not in CLAIMS:
            continue
        referee = looked_at(prepared, now)
        if referee.stands:
            return now, referee
    return None


def told_models(ending: Ending) -> list[ToldModel]:
    """The sets that are as good, with their errors."""
    ahead([partial(ending.models.step, hypothesis) for hypothesis, _ in ending.answer.close[:MODELS_TOLD]])
    return [_told(ending, hypothesis, share) for hypothesis, share in ending.answer.close[:MODELS_TOLD]]


def predicts_best(ending: Ending) -> ToldModel | None:
    """The set of the library's effects with the least held-out error, of the most probable and all others asked."""
    hypotheses, made = ending.known.hypotheses, ending.models.made
    probable = [h for h in hypotheses.ordered() if not h.key & set(hypotheses.odds)][:HINTS]
    ahead([partial(ending.models.step, h) for h in probable])
    for hypothesis in probable:
        ending.models.step(hypothesis)
    proper = [key for key, step in made.items() if step.fit.proper and not key & set(hypotheses.odds)]
    if not proper:
        return None
    least = hypotheses.found[min(proper, key=lambda key: made[key].E_heldout)]
    # Probabilities of the sets that are as good say what those of all others are.
    (first, share), *_ = ending.answer.close
    return _told(ending, least, share * math.exp(min(least.evidence - first.evidence, 0.0)))


def _told(ending: Ending, hypothesis: Hypothesis, share: float) -> ToldModel:
    step = ending.models.step(hypothesis)
    return ToldModel(list(hypothesis.effects), step.E_heldout, hypothesis.evidence, step.fit.values(), share)


def looked_at(prepared: Prepared, ending: Ending) -> Referee:
    """What the referee says of the last model."""
    hypotheses, final = ending.known.hypotheses, ending.final
    added = prepared.question.added(final.effects)
    plain = hypotheses.found[frozenset()].fit if added else None
    case = Case(
        final.fit, plain, prepared.rows, final.whiten, prepared.scale, prepared.question.accuracy, prepared.fold, added
    )
    more = [*_rows_that_show(prepared, ending), *held_out_falls(ending, added)]
    # Of an answer that leaves something systematic nothing is claimed, however it holds.
    if ending.complete:
        more += [*stability(case, hypotheses, ending.answer), *throughout(prepared, final, added)]
    return refereed(case, more)


def _unshown_in(prepared: Prepared, ending: Ending) -> list[str]:
    """Effects of an answer that leaves nothing, which the rows cannot show: it is none."""
    return [name for name in ending.answer.shown.effects if ending.complete and name in prepared.question.unshown]


def _rows_that_show(prepared: Prepared, ending: Ending) -> list[Check]:
    """What rows it would need to tell an effect of the answer from others, where these cannot."""
    return [
        Check(
            ROWS_SHOW, CANNOT, None, None,
            f"{name} would explain what is missing, but these rows cannot show it: it {needs}.",
        )
        for name, needs in prepared.question.unshown.items()
        if name in _unshown_in(prepared, ending)
    ]  # fmt: skip


def held_out_falls(ending: Ending, added: Sequence[str]) -> list[Check]:
    """Whether the error on states left out, of all readings alike, is not larger with what was found than without."""
    if not added:
        return []
    before, after = ending.models.step(ending.known.hypotheses.found[frozenset()]), ending.final
    most = (1 + RISES) * before.E_heldout
    says = f"With what was found the held-out error is {error_in_words(after.E_heldout)}"
    says += f", without it {error_in_words(before.E_heldout)}."
    return [Check("held-out error", FAIL if after.worse(before) else PASS, after.E_heldout, most, says)]


def verdict(ending: Ending, sorted_by: Sequence[str] = ()) -> str:
    """adequate, named, class, proposed or unexplained: what the last model and its classes amount to.

    sorted_by: inputs of which an unknown function would do as well as a drift. Few rows leave no structure to see in
    what a failed fit misses; it explains nothing all the same.
    """
    if not ending.complete:
        return "unexplained"
    if not ending.classes:
        return "adequate"
    if any(p.written.name in ending.final.effects for p in ending.proposals):
        return "proposed"
    return "class" if sorted_by or any(len(members) > 1 for members in ending.classes) else "named"


def decided(claimed: str, referee: Referee, answer: Answer) -> str:
    """The claim that stands: undecided where the table cannot tell."""
    claim = referee.verdict(claimed)
    nothing = sum(share for hypothesis, share in answer.close if not hypothesis.effects)
    if claim == "adequate" and nothing < EVEN:
        return "undecided"
    if claim in ("named", "class") and answer.doubted:
        return "undecided"
    # Where one place is told the others may stay open.
    if claim == "class" and all(len(members) > MOST_ALIKE for members in answer.classes):
        return "undecided"
    return claim


def staircase(prepared: Prepared, ending: Ending) -> list[Step]:
    """The models from the first to the last, each with the effect more that lowers the error most."""
    hypotheses, final, models = ending.known.hypotheses, ending.final, ending.models
    left = set(prepared.question.added(final.effects))
    if not left:
        return [final]

    def weighed(fit: WhiteFit, whiten: Whitener) -> Step:
        same = whiten.doubt is None or whiten is models.whiten
        return prepared.step(fit if same else refitted(fit, prepared.rows, whiten), whiten, final.whiten.slipped)

    def on_the_way(hypothesis: Hypothesis) -> Step:
        return weighed(hypothesis.fit, models.weighing(hypothesis.fit, final.whiten))

    now = hypotheses.found[frozenset()]
    steps = [weighed(now.fit, final.whiten)]
    while len(left) > 1:
        tried = [hypotheses.joined(now, name) for name in sorted(left)]
        ahead([partial(on_the_way, h) for h in tried])
        step, now = min(((on_the_way(h), h) for h in tried), key=lambda pair: pair[0].E_heldout)
        steps.append(step)
        left -= now.key
    return [*steps, final]


def candidates(
    prepared: Prepared, hypotheses: Hypotheses, promised: Sequence[Promise], whiten: Whitener
) -> list[Candidate]:
    """Entries of discovery.json for the effects that were tried on the first model."""
    entries = []
    shown = [hypotheses.found.get(frozenset([promise.effect])) for promise in promised[:SHOWN]]
    ahead([partial(prepared.step, h.fit, whiten) for h in shown if h and h.fit.proper])
    for number, promise in enumerate(promised):
        fitted = hypotheses.found.get(frozenset([promise.effect])) if number < SHOWN else None
        step = prepared.step(fitted.fit, whiten) if fitted and fitted.fit.proper else None
        entries.append(_entry(promise, step))
    return entries


def _entry(promise: Promise, step: Step | None) -> Candidate:
    return Candidate(
        step=0,
        effect=promise.effect,
        status=promise.status,
        reason=promise.reason,
        score=promise.chi2,
        p_value=promise.p_value,
        E_heldout=step.E_heldout if step else None,
        E_new_sample=step.E_new_sample if step else None,
    )


def slipped_together(prepared: Prepared, final: Step) -> tuple[list[Block], Step]:
    """Blocks of readings that explain what is left, or more than a drift does, and the last model: then without the
    drift, and without other effects that only mended what the blocks explain."""
    drifts = DRIFT in prepared.question.added(final.effects)
    if not drifts and not final.left.shows:
        return [], final
    step = without(prepared, final, DRIFT) if drifts else final
    found = blocks(step, prepared.rows) if step else None
    if step is None or found is None or not found.explain:
        return [], final
    if drifts and found.gain <= step.fit.chi2 - final.fit.chi2:
        return [], final
    for effect in prepared.question.added(step.effects):
        fewer = without(prepared, step, effect)
        again = blocks(fewer, prepared.rows) if fewer else None
        if fewer and again and again.explain and fewer.fit.chi2 - again.gain < step.fit.chi2 - found.gain + IDLE:
            step, found = fewer, again
    return found.found, step
