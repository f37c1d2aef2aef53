"""One written effect on top of a base: guessed, fitted, chosen; and those that the data cannot tell from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from freelearn.inference.crossval import paired
from freelearn.inference.prepare import Prepared
from freelearn.inference.proposals.guess import Guess
from freelearn.inference.proposals.pushes import pushes
from freelearn.inference.proposals.scan import Scan
from freelearn.inference.proposals.trial import Trial, tried
from freelearn.inference.refit import rewhitened
from freelearn.inference.step import Step
from freelearn.inference.thresholds import (
    ALPHA,
    FITTED,
    LEFT,
    ONE_PLACE,
    PLACES_TOLD,
    RIVALS,
    TOGETHER,
    UNDECIDED,
    WHITENINGS,
)
from freelearn.models.effects.registry import lent
from freelearn.work import begin


@dataclass(frozen=True)
class Proposed:
    """chosen: the written effect, fitted on top of the base; twins: others that the data cannot
    tell from it; gain: reduction of χ² with the base's noise; places: of each place and its inputs the most promising
    guess, best first."""

    base: Step
    chosen: Trial
    twins: Sequence[Trial]
    gain: float
    places: Sequence[Guess] = ()


def proposed(prepared: Prepared, base: Step) -> Proposed | None:
    """The best written effect on top of a base, whether or not it leaves nothing; None where none clearly helps."""
    begin("looking where something that is in no list would enter")
    guesses = guessed(prepared, base)
    if not guesses or guesses[0].p_value > ALPHA:
        return None
    trials: list[Trial] = []
    for guess in shortlist(guesses):
        begin("fitting an effect of its own")
        trial = tried(prepared, base, guess.written())
        if trial is not None and not trial.step.worse(base):
            trials.append(trial)
    if not trials:
        return None
    best = min(trials, key=lambda t: t.cost(min(other.step.left.scale for other in trials)))
    gain, error = paired(best.step.heldout, base.heldout)
    if gain <= TOGETHER * error:
        return None
    return replace(settled(prepared, base, best, trials), places=best_of_places(guesses)[:PLACES_TOLD])


def guessed(prepared: Prepared, base: Step, pairs: bool = True) -> list[Guess]:
    """What every form promises on top of a base, best first. pairs: of inputs too."""
    on, seed = prepared.question.on(base.effects), prepared.question.seed
    seen = pushes(base.fit, prepared.rows, on)
    return Scan(base.fit, prepared.rows, base.whiten, base.left.scale**2, on, seed).guesses(seen, pairs)


def settled(prepared: Prepared, base: Step, best: Trial, trials: Sequence[Trial]) -> Proposed:
    """The choice among trials, once the noise is that of a model that has the effect: before, what is missing counts as
    noise, and hides how they differ."""
    for _ in range(WHITENINGS):
        with lent([best.kind]):
            again = Trial(best.written, rewhitened(prepared, best.step))
        same = abs(again.step.left.scale / best.step.left.scale - 1) < 1e-2
        best = again
        if same:
            break
    scale = best.step.left.scale
    close = [best]
    for trial in sorted(trials, key=lambda t: t.cost(scale))[:RIVALS]:
        if trial.written != best.written:
            other = tried(prepared, base, trial.written, best.step.whiten, trial.step)
            if other is not None:
                close.append(other)
    complete = [t for t in close if t.step.left.p_value >= LEFT] or close
    chosen = min(complete, key=lambda t: t.cost(scale))
    alike = [t for t in close if t is not chosen and alike_to(t, chosen, scale)]
    gain = base.fit.chi2 - min(t.step.fit.chi2 for t in trials)
    return Proposed(base, chosen, sorted(alike, key=lambda t: t.cost(scale)), gain)


def best_of_places(guesses: Sequence[Guess]) -> list[Guess]:
    """Of each place and its inputs the most promising guess, best first."""
    best: dict[tuple[str, tuple[str, ...]], Guess] = {}
    for guess in guesses:
        best.setdefault(guess.key, guess)
    return list(best.values())


def shortlist(guesses: Sequence[Guess]) -> list[Guess]:
    """The most promising guesses, of several places."""
    taken: list[Guess] = []
    for guess in guesses:
        if guess.worth <= 0 or len(taken) == FITTED:
            break
        if sum(other.key == guess.key for other in taken) < ONE_PLACE:
            taken.append(guess)
    return taken


def alike_to(trial: Trial, chosen: Trial, scale: float) -> bool:
    """Whether the data cannot tell it from the chosen one: what it explains is as much, for its constants."""
    return trial.cost(scale) - chosen.cost(scale) <= UNDECIDED
