"""Beyond the library: forms that the search writes itself join the candidates, at odds that thousands of them have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from freelearn.discovery.fits.prepare import Prepared
from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.white_fit import WhiteFit, refitted
from freelearn.discovery.proposals.proposal import Guess, Proposal, Twin
from freelearn.discovery.proposals.propose import best_of_places, guessed, promised_alone, shortlist
from freelearn.discovery.residuals.slipped_blocks import blocks
from freelearn.discovery.search.answer import Answer, Ending, ended
from freelearn.discovery.search.hypothesis import Hypothesis
from freelearn.discovery.search.stages import Explored, continued
from freelearn.discovery.thresholds import ALIKE, MANY, NEARLY, PLACES_TOLD, SEVERAL, WRITTEN_ODDS, WRITTEN_ROUNDS
from freelearn.physics.chain.effect import Effect
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import Written

Kinds = dict[str, tuple[Written, type[Effect[Any]]]]


def asked_beyond(prepared: Prepared, known: Explored, before: Ending) -> bool:
    """Whether what the search writes itself is to compete with the library: where that has no answer, or one of several
    effects, which may stand for one that it lacks."""
    count = len(before.answer.shown.effects)
    if not before.complete or count >= MANY:
        return True
    return count >= SEVERAL and _one_may_do(prepared, known, before)


def beyond(prepared: Prepared, known: Explored, before: Ending, stack: ExitStack) -> Ending:
    """The ending where what the search writes itself competes with the library; the one before where that does not win.

    What is written stays known as long as the stack is open.
    """
    # A form is chosen by digits that a model which is wrong does not have: under the noise alone, whatever the doubt.
    alone = known.noise.whitener()

    def guesses(fit: WhiteFit) -> list[Guess]:
        return guessed(prepared, refitted(fit, prepared.rows, alone, roughly=True), alone)

    first = known.hypotheses.found[frozenset()].fit
    on_first = guesses(first)
    bases = [on_first]
    if before.final.effects != before.known.hypotheses.question.given:
        bases.append(guesses(before.final.fit))
    kinds: Kinds = {}
    found, after, wrote = known, before, list[str]()
    for _ in range(WRITTEN_ROUNDS):
        new = _new_kinds(bases)
        if not new:
            break
        kinds |= new
        stack.enter_context(lent([kind for _, kind in new.values()]))
        more, hopeful = continued(prepared, found, dict.fromkeys(kinds, WRITTEN_ODDS), after.complete)
        found, after = more, ended(prepared, more) if hopeful else after
        wrote = [name for name in after.answer.shown.effects if name in kinds]
        # Beside what was written something else may be left that is in no library.
        final = after.final
        if not wrote or after.complete or final.E_heldout > NEARLY * final.whiten.found_floor(prepared.scale):
            break
        bases = [guesses(final.fit)]
    if not kinds:
        return before
    if not wrote:
        # What is in no library may still say, as a hint, what a model lacks that stays unexplained.
        return before if before.complete else replace(before, proposals=_hint(prepared, before, found, kinds, on_first))
    if not after.complete and before.complete:
        return before
    proposals = [_proposal(prepared, after.answer, after.final, name, found, kinds, on_first) for name in wrote]
    # Where something systematic is left with it too, what was written is a hint: of an answer that does not hold only
    # physics that somebody knows is told.
    return replace(after if after.complete else before, proposals=proposals)


def _one_may_do(prepared: Prepared, known: Explored, before: Ending) -> bool:
    """Whether one form promises as much as the effects of the answer explain together, or nearly: of what the last of
    them adds to the others. Not where readings that slipped together are what one of them mends, nor in a log, where
    two effects of the history are usual and no form remembers."""
    if prepared.rows.states.recording is not None:
        return False
    shown, alone = before.answer.shown, known.noise.whitener()
    first = known.hypotheses.found[frozenset()].fit
    fewer = known.hypotheses.reduced(shown, shown.effects).values()
    least = min(h.fit.chi2 for h in fewer)
    promised = promised_alone(prepared, refitted(first, prepared.rows, alone, roughly=True), alone)
    if promised < first.chi2 - least + ALIKE * (least - shown.fit.chi2):
        return False
    return not any(blocks(before.models.alone(before.models.step(h)), prepared.rows).explain for h in fewer)


def _new_kinds(bases: Sequence[Sequence[Guess]]) -> Kinds:
    """What is guessed on some models, by name, without what is lent already."""
    kinds: Kinds = {}
    for guesses in bases:
        for guess in shortlist(guesses):
            written = guess.written()
            kind = effect_class(written)
            # A user's own of this name is a candidate like any other.
            if kind.name not in EFFECTS:
                kinds.setdefault(kind.name, (written, kind))
    return kinds


def _hint(prepared: Prepared, before: Ending, found: Explored, kinds: Kinds, places: Sequence[Guess]) -> list[Proposal]:
    """The written effect that would help most, of those that were looked at."""
    told = [h for h in found.hypotheses.ordered() if len(h.effects) == 1 and h.effects[0] in kinds]
    if not told:
        return []
    step = prepared.step(told[0].fit, found.whiten)
    if step.worse(before.final) and before.final.effects:
        return []
    return [_proposal(prepared, before.answer, step, told[0].effects[0], found, kinds, places)]


def _proposal(
    prepared: Prepared, answer: Answer, step: Step, name: str, found: Explored, kinds: Kinds, places: Sequence[Guess]
) -> Proposal:
    """A written effect as it is told: its constants are those of the step's model."""
    hypotheses = found.hypotheses
    values = step.fit.values()
    written = _fitted(kinds[name][0], values)
    base = prepared.step(hypotheses.found[frozenset()].fit, found.whiten)
    members = next((c for c in answer.classes if next(iter(c)) == name), {})
    twins = [
        _twin(prepared, kinds[other][0], members[other], found) for other in members if other in kinds and other != name
    ]
    same = _same(written)
    told = best_of_places(places)[:PLACES_TOLD]
    return Proposal(written, base, step, [*([same] if same else []), *twins], told, _resembles(hypotheses, name))


def _fitted(written: Written, values: Mapping[str, float]) -> Written:
    each = {c.name: values.get(f"{written.name}.{c.name}", c.start) for c in written.constants()}
    return written.started(each)


def _same(written: Written) -> Twin | None:
    """The other place that shows the very same loads."""
    if not written.same_as:
        return None
    port, where = written.same_as.split()
    return Twin(port, where, written.inputs_named, written.form.family, written.formula, None)


def _twin(prepared: Prepared, written: Written, hypothesis: Hypothesis, found: Explored) -> Twin:
    step = prepared.step(hypothesis.fit, found.whiten)
    place = written.place
    return Twin(place.port, place.where, written.inputs_named, written.form.family, written.formula, step.E_heldout)


def _resembles(hypotheses: Any, name: str) -> tuple[str, float] | None:
    """The effect of the library that promises most of what the written one explains, and which share of it."""
    nothing = hypotheses.found[frozenset()]
    alone = hypotheses.found.get(frozenset([name]))
    promised = [
        p for p in hypotheses.ranked.get(nothing.key, []) if p.status == "tested" and p.effect not in hypotheses.odds
    ]
    if alone is None or not promised:
        return None
    best = max(promised, key=lambda p: p.chi2)
    gain = nothing.fit.chi2 - alone.fit.chi2
    return (best.effect, min(best.chi2 / gain, 1.0)) if gain > 0 else None
