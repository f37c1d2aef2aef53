"""Where the library ends: the smallest model with written effects that leaves nothing, or the best part of one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

from freelearn.inference.classify import EquivalenceClass, classes_of
from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.proposal import Proposal, Twin
from freelearn.inference.proposals.propose import Proposed, proposed
from freelearn.inference.proposals.trial import Trial
from freelearn.inference.prune import prune
from freelearn.inference.rank import rank
from freelearn.inference.refit import rewhitened
from freelearn.inference.step import Step
from freelearn.inference.thresholds import LEFT, MOST_WRITTEN, NOTHING
from freelearn.models.effects.registry import lent
from freelearn.models.written.written import Written

# Adds to the last of some steps what the library has.
Grow = Callable[[list[Step]], None]


@dataclass(frozen=True)
class Extended:
    """step: the model, on top of a base; proposals: the written effects in it; classes: of each effect added, all of
    the library that the data cannot tell from it, itself first. complete: whether nothing systematic is left."""

    base: Step
    step: Step
    proposals: list[Proposal]
    classes: Sequence[EquivalenceClass]
    complete: bool


def extended(prepared: Prepared, base: Step, grow: Grow, constants: int | None = None) -> Extended | None:
    """A base with at most MOST_WRITTEN written effects, and what the library then still has to add; None where none
    helps.

    constants: where a model with so many leaves nothing, to which nothing with more is an answer: given up once one
    effect does not do and one more would make it more."""
    step, found = base, list[Proposed]()
    with ExitStack() as stack:
        for _ in range(MOST_WRITTEN):
            more = proposed(prepared, step)
            if more is None:
                break
            stack.enter_context(lent([more.chosen.kind]))
            found.append(more)
            step = prune(prepared, rewhitened(prepared, more.chosen.step))
            if step.left.p_value < LEFT:
                if constants is not None and len(step.fit.vector) >= constants:
                    return None
                steps = [step]
                grow(steps)
                step = steps[-1]
            if step.left.p_value >= LEFT:
                break
        found = [f for f in found if f.chosen.written.name in step.effects]
        if not found:
            return None
        # Few rows leave no structure to see in what a failed fit misses.
        complete = step.left.p_value >= LEFT and step.fit.converged and step.E_heldout <= NOTHING
        classes = classes_of(prepared, step) if complete else []
        step, found, classes = _of_the_library(step, found, classes)
        proposals = [_told(prepared, f, step) for f in found]
        return Extended(base, step, proposals, classes, complete)


def _of_the_library(
    step: Step, found: list[Proposed], classes: list[EquivalenceClass]
) -> tuple[Step, list[Proposed], list[EquivalenceClass]]:
    """A written effect that one of the library stands in for is none: the library's takes its place."""
    if len(found) != 1:
        return step, found, classes
    name = found[0].chosen.written.name
    own = next((c for c in classes if next(iter(c)) == name), {})
    others = {other: fitted for other, fitted in own.items() if other != name}
    if not others:
        return step, found, classes
    best = min(others, key=lambda other: others[other].heldout.loss.sum())
    kept = [c for c in classes if c is not own]
    return others[best], [], [*kept, {best: others[best]} | others]


def _told(prepared: Prepared, found: Proposed, step: Step) -> Proposal:
    """As it is told: its constants are those of the last model."""
    chosen = replace(found.chosen, step=step)
    fitted = chosen.fitted()
    twins = [_same(fitted), *(_twin(t) for t in found.twins)]
    return Proposal(fitted, found.base, step, [t for t in twins if t], found.places, _resembles(prepared, found))


def _same(written: Written) -> Twin | None:
    """The other place that shows the very same loads."""
    if not written.same_as:
        return None
    port, where = written.same_as.split()
    return Twin(port, where, written.inputs_named, written.form.family, written.formula, None)


def _twin(trial: Trial) -> Twin:
    written = trial.written
    return Twin(
        written.place.port,
        written.place.where,
        written.inputs_named,
        written.form.family,
        written.formula,
        trial.step.E_heldout,
    )


def _resembles(prepared: Prepared, found: Proposed) -> tuple[str, float] | None:
    """The effect of the library that promises most of what the written one explains, and which share of it."""
    names = [name for name in prepared.question.candidates if name not in found.base.effects]
    tested = [s for s in rank(prepared, found.base, names, found.base.left.scale) if s.status == "tested"]
    if not tested:
        return None
    best = max(tested, key=lambda s: s.gain)
    return best.effect, min(best.gain / found.gain, 1.0)
