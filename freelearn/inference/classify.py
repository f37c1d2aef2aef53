"""Effects that could stand in the place of those added: exchanged where they explain more, named where as much."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

from freelearn.inference.crossval import paired
from freelearn.inference.prepare import Prepared
from freelearn.inference.rank import rank
from freelearn.inference.refit import refit, rewhitened, without
from freelearn.inference.step import Step
from freelearn.inference.thresholds import BETTER, COINCIDE, COMPARABLE, EXCHANGES, WORTH_EXCHANGING
from freelearn.work import begin

# For one effect, all that the data cannot tell from it, itself first, each with the fit of the whole model.
EquivalenceClass = dict[str, Step]


def classify(
    prepared: Prepared, final: Step, watch: Callable[[Step, str], None]
) -> tuple[Step, list[EquivalenceClass]]:
    """The last model, effects exchanged for better ones where there are any, and the class of each effect added.

    The classes are those of the model that is returned, also when the exchanges have run out."""
    for _ in range(EXCHANGES):
        classes: list[EquivalenceClass] = []
        for effect in prepared.question.added(final.effects):
            rivals = stand_ins(prepared, final, effect)
            best = min(rivals, key=lambda name: rivals[name].heldout.loss.sum())
            gain = paired(rivals[best].heldout, final.heldout)[0]
            if best != effect and gain > WORTH_EXCHANGING and not rivals[best].worse(final):
                final = rewhitened(prepared, rivals[best]).tried(final.candidates)
                watch(final, f"{best} in place of {effect}")
                break
            classes.append(alike(effect, rivals))
        else:
            fewer = one_for_two(prepared, final, classes)
            if fewer is None:
                return final, classes
            final = rewhitened(prepared, fewer).tried(final.candidates)
            watch(final, f"{final.effects[-1]} in place of two")
    return final, classes_of(prepared, final)


def classes_of(prepared: Prepared, final: Step) -> list[EquivalenceClass]:
    """The class of each effect that was added."""
    return [alike(effect, stand_ins(prepared, final, effect)) for effect in prepared.question.added(final.effects)]


def one_for_two(prepared: Prepared, final: Step, classes: list[EquivalenceClass]) -> Step | None:
    """The model with one effect in the place of two that it stands in both classes of, if it predicts as well."""
    for one, other in combinations(classes, 2):
        first, second = next(iter(one)), next(iter(other))
        # In the order of the class: a set's own order is another one in every process.
        for name in (n for n in one if n in other and n not in (first, second)):
            # Without the second effect; the first has been exchanged for the shared one already.
            fewer = without(prepared, one[name], second)
            if fewer is not None:
                mean, error = paired(final.heldout, fewer.heldout)
                if mean < BETTER * error and not fewer.worse(final):
                    return fewer
    return None


def stand_ins(prepared: Prepared, final: Step, effect: str) -> dict[str, Step]:
    """The final model, and the models with another effect in the place of this one, by that effect's name."""
    models = {effect: final}
    begin(f"looking what could stand in for {effect}")
    reduced = without(prepared, final, effect)
    if reduced is None:
        return models
    others = [name for name in prepared.question.candidates if name not in final.effects]
    # The noise is that of the final model: what the reduced one lacks is known, and no noise.
    scores = rank(prepared, reduced, [effect, *others], final.left.scale)
    own = next(s.gain for s in scores if s.effect == effect)
    comparable = [s for s in scores if s.effect != effect and s.gain >= COMPARABLE * own]
    return models | refit(prepared, reduced, comparable, rival=final.fit.chi2)[0]


def alike(effect: str, rivals: dict[str, Step]) -> EquivalenceClass:
    """Those of the rivals that predict held-out states as well as the effect itself.

    As well: within one standard error of the paired difference, or with a difference in χ² that noise makes wherever
    two signatures coincide."""
    reference = rivals[effect]
    members = {effect: reference}
    for name, other in rivals.items():
        mean, error = paired(reference.heldout, other.heldout)
        if name != effect and (mean < error or mean * len(other.heldout.loss) < COINCIDE):
            members[name] = other
    return members
