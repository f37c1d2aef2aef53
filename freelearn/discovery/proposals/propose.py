"""Effects that are in no library: the forms that the residuals of a model ask for most."""

from __future__ import annotations

from collections.abc import Sequence

from freelearn.common.progress import begin
from freelearn.discovery.fits.prepare import Prepared
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.noise.structure import structure
from freelearn.discovery.proposals.proposal import Guess
from freelearn.discovery.proposals.pushes import pushes
from freelearn.discovery.proposals.scan import Scan
from freelearn.discovery.thresholds import FITTED, ONE_PLACE


def guessed(prepared: Prepared, fit: WhiteFit, whiten: Whitener) -> list[Guess]:
    """What every form promises on top of a fit, the best first."""
    begin("looking where something that is in no list would enter")
    return _scanned(prepared, fit, whiten, _variance(prepared, fit, whiten), pairs=True)


def promised_alone(prepared: Prepared, fit: WhiteFit, whiten: Whitener) -> float:
    """Reduction of χ² that the most promising form of one input promises on top of a fit."""
    variance = _variance(prepared, fit, whiten)
    return variance * max((g.gain for g in _scanned(prepared, fit, whiten, variance, pairs=False)), default=0.0)


def _variance(prepared: Prepared, fit: WhiteFit, whiten: Whitener) -> float:
    """Of the whitened noise, as the fit's residuals show it."""
    return structure(fit.residual, fit.jacobian, prepared.rows.states, whiten).scale ** 2


def _scanned(prepared: Prepared, fit: WhiteFit, whiten: Whitener, variance: float, pairs: bool) -> list[Guess]:
    """pairs: of inputs too."""
    on = prepared.question.on([effect.name for effect in fit.model.effects])
    seen = pushes(fit, prepared.rows, on, prepared.question.clocked)
    return Scan(fit, prepared.rows, whiten, variance, on).guesses(seen, pairs)


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
