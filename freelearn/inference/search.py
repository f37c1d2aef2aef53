"""The loop: which effect is missing, add it, look again, until nothing systematic is left or nothing helps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from freelearn.inference.candidate import StepRecord
from freelearn.inference.classify import EquivalenceClass, classify
from freelearn.inference.crossval import paired
from freelearn.inference.prepare import Prepared, prepare
from freelearn.inference.prune import prune
from freelearn.inference.question import Question
from freelearn.inference.rank import outcomes, rank
from freelearn.inference.refit import refit, rewhitened
from freelearn.inference.step import Step
from freelearn.inference.thresholds import ALPHA, BETTER, LEFT, MOST_EFFECTS
from freelearn.inference.white_fit import white_fit
from freelearn.measurements.rows import Rows

# Told of each new step and what it is.
Watch = Callable[[Step, str], None]
# Given all steps so far after each, so that an interrupted search can be taken up again.
Keep = Callable[[Sequence[Step]], None]


@dataclass(frozen=True)
class Findings:
    """What a search ends with.

    verdict: adequate, named, class or unexplained. effects: those that were missing, in the order in which they were
    added, without those given. classes: for each of them all that the data cannot tell from it, itself first, with its
    fit. steps: the models on the way, the first with the given effects alone. rows: those with an answer; kept: which
    of the question's rows these are. noise_floor: the error of a perfect model, a fraction."""

    verdict: str
    effects: list[str]
    classes: list[EquivalenceClass]
    steps: list[Step]
    rows: Rows
    kept: np.ndarray
    noise_floor: float

    @property
    def final(self) -> Step:
        """The last model."""
        return self.steps[-1]


def search(
    question: Question, known: Sequence[StepRecord] = (), watch: Watch | None = None, keep: Keep | None = None
) -> Findings:
    """Adds the missing effects one by one.

    prepare → (rank → refit → prune) for each effect → classify. known: records of the steps of an interrupted search of
    the same question (see `record`), which are taken up again instead of being searched for.
    """
    watch, keep = watch or (lambda step, text: None), keep or (lambda steps: None)
    prepared, first = prepare(question)
    steps = resumed(prepared, first, known)
    watch(steps[-1], "base model" if len(steps) == 1 else "resumed")
    while len(question.added(steps[-1].effects)) < MOST_EFFECTS:
        steps[-1], best = advance(prepared, steps[-1], len(steps) - 1)
        if best is None:
            break
        best = prune(prepared, best)
        if any(set(best.effects) == set(step.effects) for step in steps):
            break
        steps.append(best)
        watch(best, f"added {best.effects[-1]}")
        keep(steps)
    steps[-1], classes = classify(prepared, steps[-1], watch)
    final = steps[-1]
    effects = question.added(final.effects)
    return Findings(verdict(final, classes), effects, classes, steps, prepared.rows, prepared.kept, final.floor)


def advance(prepared: Prepared, step: Step, number: int) -> tuple[Step, Step | None]:
    """The step with the candidates that were tried on it, and the model with the one more effect that predicts held-out
    states best; None when none is significant. number: the step's place in the trail."""
    others = [name for name in prepared.question.candidates if name not in step.effects]
    scores = rank(prepared, step, others, step.left.scale)
    significant = {s.effect for s in scores if s.status == "tested" and s.p_value <= ALPHA}
    fitted: dict[str, Step] = {}
    if significant:
        fitted, scores = refit(prepared, step, scores)
    step = step.tried(outcomes(number, scores, fitted), scores)
    better = []
    for name, other in fitted.items():
        gain, error = paired(other.heldout, step.heldout)
        if name in significant and gain > BETTER * error:
            better.append(other)
    if not better:
        return step, None
    return step, rewhitened(prepared, min(better, key=lambda other: other.heldout.loss.sum()))


def resumed(prepared: Prepared, first: Step, known: Sequence[StepRecord]) -> list[Step]:
    """The steps of an interrupted search, fitted once more from where they ended."""
    steps = [first]
    for number, past in enumerate(known):
        if number:
            model = prepared.question.build(past["effects"])
            start = torch.tensor([past["vector"][label] for label in model.labels()], dtype=torch.float64)
            fit = white_fit(model, prepared.rows, steps[-1].whiten, start)
            again = prepared.step(list(past["effects"]), fit, steps[-1].whiten)
            steps.append(rewhitened(prepared, again))
        steps[-1] = steps[-1].tried(list(past["candidates"]))
    return steps


def verdict(final: Step, classes: Sequence[EquivalenceClass]) -> str:
    """adequate, named, class or unexplained: what the last model and its classes amount to."""
    if final.left.p_value < LEFT:
        return "unexplained"
    if not classes:
        return "adequate"
    return "class" if any(len(members) > 1 for members in classes) else "named"
