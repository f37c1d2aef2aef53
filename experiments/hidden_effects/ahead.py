"""How much more probable the effects that were hidden are than those that a search found.

Where they are not, more looking finds nothing better: the rows do not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hidden_effects.few import Few

from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.hypothesis import Hypothesis
from freelearn.discovery.search.search import Findings, ToldModel
from freelearn.physics.chain.priors import spans


def ahead(found: Findings, question: Question, made: Few) -> float | None:
    """Logarithm of the odds of the set that was hidden against the most probable one told, both fitted under the noise
    of the answer, the hidden one from its true values. None where nothing is hidden that the library has."""
    if not made.hidden or not set(made.hidden) <= set(question.candidates):
        return None
    sets = Hypotheses(question, found.rows, found.final.whiten, spans(found.rows))

    def fitted(effects: Sequence[str], values: Mapping[str, float]) -> Hypothesis:
        model = sets.build([name for name in sets.library if name in effects])
        # The reference may count some by other names; a fit finds these itself.
        model.set_values({name: value for name, value in values.items() if name in model.declared})
        return sets.fit(effects, model.vector().detach())

    told = [fitted(each.effects, each.parameters) for each in of_library(found, question)] or [fitted([], {})]
    true = {f"{name}.{p}": value for name, values in made.hidden.items() for p, value in values.items()}
    truth = fitted(list(made.hidden), true | dict(zip(("C1", "C2"), made.material, strict=True)))
    return truth.evidence - max(each.evidence for each in told)


def of_library(found: Findings, question: Question) -> list[ToldModel]:
    """The sets told that have no effect that the search wrote."""
    return [each for each in found.models if set(each.effects) <= set(question.candidates)]
