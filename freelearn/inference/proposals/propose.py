"""Effects that are in no library: the forms that the residuals of a model ask for most."""

from __future__ import annotations

from collections.abc import Sequence

from freelearn.inference.noise import Whitener
from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.guess import Guess
from freelearn.inference.proposals.pushes import pushes
from freelearn.inference.proposals.scan import Scan
from freelearn.inference.structure import structure
from freelearn.inference.thresholds import FITTED, ONE_PLACE
from freelearn.inference.white_fit import WhiteFit
from freelearn.work import begin


def guessed(prepared: Prepared, fit: WhiteFit, whiten: Whitener, pairs: bool = True) -> list[Guess]:
    """What every form promises on top of a fit, the best first. pairs: of inputs too."""
    begin("looking where something that is in no list would enter")
    on = prepared.question.on([effect.name for effect in fit.model.effects])
    scale = structure(fit.residual, fit.jacobian, prepared.rows.states, whiten).scale
    seen = pushes(fit, prepared.rows, on, prepared.question.clocked)
    return Scan(fit, prepared.rows, whiten, scale**2, on).guesses(seen, pairs)


def shortlist(guesses: Sequence[Guess], most: int = FITTED) -> list[Guess]:
    """The most promising guesses, of several places."""
    taken: list[Guess] = []
    for guess in guesses:
        if guess.worth <= 0 or len(taken) == most:
            break
        if sum(other.key == guess.key for other in taken) < ONE_PLACE:
            taken.append(guess)
    return taken


def best_of_places(guesses: Sequence[Guess]) -> list[Guess]:
    """Of each place and its inputs the most promising guess, best first."""
    best: dict[tuple[str, tuple[str, ...]], Guess] = {}
    for guess in guesses:
        best.setdefault(guess.key, guess)
    return list(best.values())
