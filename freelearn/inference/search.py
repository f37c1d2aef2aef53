"""The loop: which effect is missing, add it, look again, until nothing systematic is left or nothing helps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from freelearn.inference.beyond import Beyond
from freelearn.inference.blocks import Block, blocks
from freelearn.inference.classify import EquivalenceClass, classes_of, classify
from freelearn.inference.crossval import paired
from freelearn.inference.look_ahead import look_ahead
from freelearn.inference.misplaced import misplaced
from freelearn.inference.order import DRIFT, confounded, in_order_of
from freelearn.inference.prepare import Prepared, prepare
from freelearn.inference.proposals.proposal import Proposal
from freelearn.inference.prune import prune
from freelearn.inference.question import Question
from freelearn.inference.rank import outcomes, rank
from freelearn.inference.refit import refit, rewhitened, without
from freelearn.inference.smallest import smallest
from freelearn.inference.step import Step
from freelearn.inference.suspects import Suspect, suspects
from freelearn.inference.thresholds import (
    ALPHA,
    ASKED,
    BETTER,
    IDLE,
    LEFT,
    MANY,
    MOST_EFFECTS,
    NOTHING,
    REGROWN,
    UNASKED,
)
from freelearn.measurements.rows import Rows
from freelearn.work import begin

# Told of each new step and what it is.
Watch = Callable[[Step, str], None]


@dataclass(frozen=True)
class Findings:
    """What a search ends with.

    verdict: adequate, named, class, proposed or unexplained. effects: those that were missing, in the order in which
    they were added, without those given. classes: for each of them all that the data cannot tell from it, itself first,
    with its fit. steps: the models on the way, the first with the given effects alone. rows: those with an answer;
    kept: which of the question's rows these are. noise_floor: the error of a perfect model, a fraction. suspects:
    readings that slipped, perhaps. sorted_by: inputs of which, for the order of measuring, an unknown function would
    explain as much as the drift that was found. proposals: effects that the search wrote itself; where it stays
    unexplained, the best part of an answer, which the last model does not have."""

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

    @property
    def final(self) -> Step:
        """The last model."""
        return self.steps[-1]


def search(question: Question, watch: Watch | None = None) -> Findings:
    """Adds the missing effects one by one.

    prepare → (rank → refit → prune) for each effect → classify, and once more where that exchanged an effect and
    something is left. What stays unexplained keeps no effect that explains little beside it. Inside a journal (see
    `kept_in`) it goes on from where an interrupted search of the same question was.
    """
    watch = watch or (lambda step, text: None)
    begin("fitting the model as it is, and how its readings scatter")
    prepared, first = prepare(question)
    steps = [first]
    watch(first, "base model")
    beyond = Beyond(prepared, steps[0], lambda more: grow(prepared, more))
    classes = from_library(prepared, steps, beyond, watch)
    together, without_drift = slipped_together(prepared, steps[-1])
    if without_drift is not steps[-1]:
        steps[-1] = without_drift
        watch(steps[-1], "a block of readings slipped instead")
        classes = classes_of(prepared, steps[-1])
    # One block that slipped is simpler than a function of the time; several at once are not.
    found = beyond.instead(steps[-1]) if len(together) != 1 else None
    if found and found.complete:
        together = []
        # The steps that the library took lead elsewhere.
        base = next(i for i, step in enumerate(steps) if step.effects == found.base.effects)
        steps, classes = [*steps[: base + 1], found.step], list(found.classes)
        watch(found.step, f"wrote {', '.join(p.written.name for p in found.proposals) or 'nothing'}")
    elif not classes:
        # The library's search may have ended for what is not taken after all.
        classes = classes_of(prepared, steps[-1])
    final = steps[-1]
    ordered = in_order_of(prepared.rows.states) if together else []
    pointed_out = [block.suspect(prepared.rows, prepared.kept, ordered) for block in together]
    pointed_out += suspects(final, prepared.rows, prepared.kept)
    # Of a model that lacks something, any state may look misplaced.
    if not together and final.left.p_value >= LEFT:
        pointed_out += misplaced(final, prepared.rows, prepared.kept)
    sorted_by = confounded(prepared, final)
    slipped = final.whiten.scatter.slipped if final.whiten.scatter else None
    steps = [prepared.judged(step, slipped) for step in steps]
    return Findings(
        verdict(final, classes, sorted_by, bool(found and found.complete and found.proposals)),
        question.added(final.effects),
        classes,
        steps,
        prepared.rows,
        prepared.kept,
        final.floor,
        pointed_out,
        sorted_by,
        found.proposals if found else [],
    )


def from_library(prepared: Prepared, steps: list[Step], beyond: Beyond, watch: Watch) -> list[EquivalenceClass]:
    """Adds to the steps what the library has, exchanges what explains less, and takes out what explains little of what
    stays unexplained; the classes of what the last of them has. Where what is written leaves nothing, it ends early."""
    classes: list[EquivalenceClass] = []
    for _ in range(REGROWN):
        grow(prepared, steps, watch, beyond.ends)
        before = steps[-1]
        if before.left.p_value < LEFT and beyond.ends(before):
            return []
        steps[-1], classes = classify(prepared, before, watch)
        if steps[-1].left.p_value >= LEFT or set(steps[-1].effects) == set(before.effects):
            break
    if steps[-1].left.p_value < LEFT and prepared.question.added(steps[-1].effects):
        reduced = smallest(prepared, steps[-1])
        if reduced is not steps[-1]:
            steps[-1] = reduced.tried(steps[-1].candidates)
            watch(steps[-1], "without what explains little")
            classes = classes_of(prepared, steps[-1])
    return classes


def slipped_together(prepared: Prepared, final: Step) -> tuple[list[Block], Step]:
    """Blocks of readings that explain what is left, or more than a drift does, and the last model: then without the
    drift, and without other effects that only mended what the blocks explain."""
    drifts = DRIFT in prepared.question.added(final.effects)
    if not drifts and final.left.p_value >= LEFT:
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
    return found.found, step if step is final else step.tried(final.candidates)


def grow(
    prepared: Prepared,
    steps: list[Step],
    watch: Watch = lambda step, text: None,
    ends: Callable[[Step], bool] = lambda step: False,
) -> None:
    """Adds to the last of the steps one effect after another, or two at once where no single one helps.

    ends: whether a model that leaves something need not grow; asked once it has several effects, and before pairs."""
    question = prepared.question
    while (count := len(question.added(steps[-1].effects))) < MOST_EFFECTS:
        if count >= MANY and ends(steps[-1]):
            break
        steps[-1], best = advance(prepared, steps[-1], len(steps) - 1)
        if best is None and steps[-1].left.p_value < LEFT:
            # What is written leaves nothing: of the library only a pair that does too could stand in its place.
            ended = ends(steps[-1])
            best = look_ahead(prepared, steps[-1], exchanging=not ended)
            if ended and (best is None or best.left.p_value < LEFT):
                break
        if best is None:
            break
        best = prune(prepared, best)
        if any(set(best.effects) == set(step.effects) for step in steps):
            break
        added = [effect for effect in best.effects if effect not in steps[-1].effects]
        steps.append(best)
        watch(best, f"added {', '.join(added)}")


def advance(prepared: Prepared, step: Step, number: int) -> tuple[Step, Step | None]:
    """The step with the candidates that were tried on it, and the model with the one more effect that predicts held-out
    states best; None when none is significant. number: the step's place in the trail."""
    others = [name for name in prepared.question.candidates if name not in step.effects]
    begin(f"ranking {len(others)} effects on {' + '.join(step.effects) or 'the model alone'}")
    scores = rank(prepared, step, others, step.left.scale)
    asked = not prepared.question.added(step.effects) or step.left.p_value < ASKED
    alpha = ALPHA if asked else UNASKED
    significant = {s.effect for s in scores if s.status == "tested" and s.p_value <= alpha}
    fitted: dict[str, Step] = {}
    if significant:
        fitted, scores = refit(prepared, step, scores)
    step = step.tried(outcomes(number, scores, fitted), scores)
    better = []
    for name, other in fitted.items():
        gain, error = paired(other.heldout, step.heldout)
        if name in significant and gain > BETTER * error and not other.worse(step):
            better.append(other)
    if not better:
        return step, None
    return step, rewhitened(prepared, min(better, key=lambda other: other.heldout.loss.sum()))


def verdict(
    final: Step, classes: Sequence[EquivalenceClass], sorted_by: Sequence[str] = (), wrote: bool = False
) -> str:
    """adequate, named, class, proposed or unexplained: what the last model and its classes amount to.

    wrote: whether it has an effect that the search wrote. sorted_by: inputs of which an unknown function would do as
    well as a drift. Few rows leave no structure to see in what a failed fit misses; it explains nothing all the same.
    """
    if final.left.p_value < LEFT or not final.fit.converged or final.E_heldout > NOTHING:
        return "unexplained"
    if not classes:
        return "adequate"
    if wrote:
        return "proposed"
    return "class" if sorted_by or any(len(members) > 1 for members in classes) else "named"
