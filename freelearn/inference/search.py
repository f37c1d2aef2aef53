"""The loop: which effect is missing, add it, look again, until nothing systematic is left or nothing helps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.fit.starts import starts
from freelearn.inference.crossval import HeldOut, cross_validate, folds_of, paired
from freelearn.inference.noise import Whitener, sensitivities
from freelearn.inference.score import EffectScore, score_effects
from freelearn.inference.structure import Structure, norms, structure
from freelearn.inference.white_fit import WhiteFit, white_fit
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Rows
from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.prediction import Status

# Chance of naming an effect, in one step, where there is nothing to find.
ALPHA = 0.01
# Chance of calling a complete model incomplete. It is met at the end of every search, right or wrong, so smaller.
LEFT = 0.002
MOST_EFFECTS = 6
# Candidates that are fitted in full at each step, the most promising ones.
REFITTED = 6
# Rounds in which an effect already in may be exchanged for one that explains more.
EXCHANGES = 3
WHITENINGS = 3
# An effect this many σ from no effect, by its own standard errors, is not tested for being idle.
CERTAIN = 15.0
# Difference in χ² that speaks for neither of two models: two standard deviations of one whitened number.
COINCIDE = 4.0
# A stand-in must promise, to first order, at least this share of what the effect itself promises.
COMPARABLE = 0.25


@dataclass
class Step:
    """One model on the way: its fit, held-out residuals, what is left, and the candidates that were tried on it.

    E_train, E_heldout: the paper's error on the fitted rows and on held-out kinematic states; E_new_sample: on whole
    samples left out in turn (None with one sample, or where a parameter belongs to a sample); floor: what measuring
    alone leaves of it (fractions)."""

    effects: list[str]
    fit: WhiteFit
    whiten: Whitener
    heldout: HeldOut
    states: States
    E_train: float
    E_heldout: float
    E_new_sample: float | None
    floor: float
    candidates: list[dict[str, Any]] = field(default_factory=list)
    scores: list[EffectScore] = field(default_factory=list)

    @cached_property
    def left(self) -> Structure:
        """What is systematic in the residuals that are left."""
        return structure(self.fit.residual, self.fit.jacobian, self.states, self.whiten)


@dataclass
class Findings:
    """verdict: adequate, named, class or unexplained. classes: for each effect all that the data cannot tell from it,
    itself first, with its fit. rows: those with an answer."""

    verdict: str
    effects: list[str]
    classes: list[dict[str, Step]]
    steps: list[Step]
    rows: Rows
    kept: np.ndarray
    noise_floor: float

    @property
    def final(self) -> Step:
        return self.steps[-1]


# Told of each new step and what it is.
Watch = Callable[[Step, str], None]


def record(step: Step) -> dict[str, Any]:
    """What a search needs to take the step up again, as plain values."""
    vector = dict(zip(step.fit.model.labels(), step.fit.vector.tolist(), strict=True))
    return {"effects": step.effects, "vector": vector, "candidates": step.candidates}


class Search:
    """Finds the missing effects of a model over rows. build: effect names → fresh model with these effects."""

    def __init__(
        self,
        build: Callable[[Sequence[str]], Model],
        candidates: Sequence[str],
        rows: Rows,
        accuracy: Accuracy,
        seed: int,
        watch: Watch | None = None,
    ) -> None:
        self.build, self.names, self.accuracy, self.seed = build, list(candidates), accuracy, seed
        self.all_rows, self.watch = rows, watch or (lambda step, text: None)
        # Called with all steps so far after each, so that an interrupted search can be taken up again.
        self.keep: Callable[[list[Step]], None] = lambda steps: None
        self.scale = load_scale(rows.loads)

    def run(self, given: Sequence[str] = (), known: Sequence[Mapping[str, Any]] = ()) -> Findings:
        """Searches from a model that has the given effects already. known: records of the steps of an interrupted
        search of the same question (see `record`), which are taken up again instead of being searched for."""
        steps = [self._base(list(given))]
        for number, past in enumerate(known):
            steps[-1].candidates = list(past["candidates"])
            if number + 1 < len(known):
                steps.append(self._again(known[number + 1], steps[-1]))
        self.watch(steps[-1], "base model" if len(steps) == 1 else "resumed")
        while len(steps[-1].effects) < MOST_EFFECTS:
            best = self._best(steps[-1])
            if best is None:
                break
            best = self._without_idle(best)
            if any(set(best.effects) == set(step.effects) for step in steps):
                break
            steps.append(best)
            self.watch(best, f"added {best.effects[-1]}")
            self.keep(steps)
        classes = self._classes(steps)
        final = steps[-1]
        if final.left.p_value < LEFT:
            verdict = "unexplained"
        elif not final.effects:
            verdict = "adequate"
        else:
            verdict = "class" if any(len(c) > 1 for c in classes) else "named"
        return Findings(verdict, final.effects, classes, steps, self.rows, self.kept, final.floor)

    def _again(self, past: Mapping[str, Any], before: Step) -> Step:
        model = self.build(past["effects"])
        start = torch.tensor([past["vector"][label] for label in model.labels()], dtype=torch.float64)
        fit = white_fit(model, self.rows, before.whiten, start)
        return self._rewhitened(self._step(list(past["effects"]), fit, before.whiten))

    # --- fits -------------------------------------------------------------------------------------------------

    def _base(self, effects: list[str]) -> Step:
        """The model before anything is added. Settles which rows have an answer, and their whitening."""
        model = self.build(effects)
        rows = self.all_rows
        model.prepare(rows.states, rows.loads)
        generator = torch.Generator().manual_seed(self.seed)
        start = starts(model, rows.states, rows.loads, 1, generator)[0]
        kept = torch.ones(len(rows), dtype=torch.bool)
        plain = Whitener(torch.zeros(len(rows), 2, 3, dtype=torch.float64), _states(rows), self._even())
        fit = white_fit(model, rows, plain, start)
        for _ in range(WHITENINGS):
            with torch.no_grad():
                now = model(self.all_rows.states).status == Status.OK
            if int(now.sum()) > 2 * len(fit.vector):
                kept = now
            rows = self.all_rows[torch.nonzero(kept)[:, 0]]
            whiten = Whitener(sensitivities(model, rows.states), _states(rows), self.accuracy)
            fit = white_fit(model, rows, whiten, fit.vector)
        self.rows, self.kept = rows, kept.numpy()
        self.fold = folds_of(rows.state, self.seed)
        return self._step(effects, fit, whiten)

    def _even(self) -> Accuracy:
        """Noise in proportion to the largest loads: the paper's error, for a first look."""
        return Accuracy(0.0, 0.0, 0.0, float(self.scale[0]), float(self.scale[1]))

    def _step(self, effects: list[str], fit: WhiteFit, whiten: Whitener) -> Step:
        heldout = cross_validate(fit, self.fold, self.rows.state)
        floor = float((whiten.variance / self.scale**2).sum(-1).mean().sqrt())
        within, outside = self._error(fit.raw_residual), self._error(heldout.raw)
        return Step(effects, fit, whiten, heldout, self.rows.states, within, outside, self._new_sample(fit), floor)

    def _new_sample(self, fit: WhiteFit) -> float | None:
        sample = self.rows.states.sample.numpy()
        count = len(np.unique(sample))
        if count < 2 or any(p.per_sample for p in fit.model.declared.values()):
            return None
        return self._error(cross_validate(fit, folds_of(sample, self.seed, count), sample).raw)

    def _error(self, raw: Tensor) -> float:
        return float((raw / self.scale).square().sum(-1).mean().sqrt())

    def _fitted(self, effects: list[str], start: Tensor, whiten: Whitener) -> Step | None:
        """A full fit of a model with these effects; None when it does not end in a proper minimum."""
        model = self.build(effects)
        fit = white_fit(model, self.rows, whiten, start)
        if not fit.converged or not bool(fit.residual.isfinite().all()):
            return None
        return self._step(effects, fit, whiten)

    # --- one step ---------------------------------------------------------------------------------------------

    def _scores(self, step: Step, names: Sequence[str]) -> list[EffectScore]:
        def build(more: Sequence[str]) -> Model:
            return self.build([*step.effects, *more])

        return score_effects(step.fit, self.rows, step.whiten, names, build, step.left.scale**2, self.seed)

    def _refits(self, step: Step, scores: list[EffectScore], most: int) -> dict[str, Step]:
        """Full fits of the most promising candidates, by name; notes the outcome of each at the step."""
        fitted: dict[str, Step] = {}
        promising = sorted((s for s in scores if s.status == "tested" and s.gain > 0), key=lambda s: -s._evidence)
        for s in promising[:most]:
            assert s.start is not None
            found = self._fitted([*step.effects, s.effect], s.start, step.whiten)
            if found is None:
                s.status, s.reason, s.p_value = "failed", "its fit did not reach a minimum", 1.0
            else:
                fitted[s.effect] = found
        return fitted

    def _note(self, step: Step, scores: list[EffectScore], fitted: dict[str, Step]) -> None:
        number = len(step.effects)
        step.scores = scores
        for s in scores:
            known = fitted.get(s.effect)
            step.candidates.append(
                {
                    "step": number,
                    "effect": s.effect,
                    "status": s.status,
                    "reason": s.reason,
                    "score": s.gain,
                    "p_value": s.p_value if s.status == "tested" else None,
                    "E_heldout": known.E_heldout if known else None,
                    "E_new_sample": known.E_new_sample if known else None,
                }
            )

    def _best(self, step: Step) -> Step | None:
        """The model with the one more effect that predicts held-out states best; None when none is significant."""
        scores = self._scores(step, [n for n in self.names if n not in step.effects])
        significant = {s.effect for s in scores if s.status == "tested" and s.p_value <= ALPHA}
        fitted = self._refits(step, scores, REFITTED) if significant else {}
        self._note(step, scores, fitted)
        better = {}
        for name, found in fitted.items():
            gain, error = paired(found.heldout, step.heldout)
            if name in significant and gain > 2 * error:
                better[name] = found
        if not better:
            return None
        name = min(better, key=lambda n: better[n].heldout.loss.sum())
        return self._rewhitened(better[name])

    def _rewhitened(self, step: Step) -> Step:
        """The same model with the noise that its own stiffness implies."""
        whiten = Whitener(sensitivities(step.fit.model, self.rows.states), _states(self.rows), self.accuracy)
        return self._step(step.effects, white_fit(step.fit.model, self.rows, whiten, step.fit.vector), whiten)

    def _reduced(self, step: Step, effect: str) -> Step | None:
        """The step's model without one effect, refitted."""
        effects = [e for e in step.effects if e != effect]
        model = self.build(effects)
        known = dict(zip(step.fit.model.labels(), step.fit.vector, strict=True))
        start = torch.stack([known[label] for label in model.labels()])
        return self._fitted(effects, start, step.whiten)

    def _without_idle(self, step: Step) -> Step:
        """Drops effects that the others have made superfluous."""
        for effect in step.effects[:-1]:
            if _certain(step, effect):
                continue
            reduced = self._reduced(step, effect)
            if reduced is None:
                continue
            gain, error = paired(step.heldout, reduced.heldout)
            if gain < 2 * error:
                return self._without_idle(self._rewhitened(reduced))
        return step

    # --- twins ------------------------------------------------------------------------------------------------

    def _classes(self, steps: list[Step]) -> list[dict[str, Step]]:
        """For each effect found, those that could stand in its place; exchanges one that explains less."""
        for _ in range(EXCHANGES):
            final = steps[-1]
            classes = []
            for effect in final.effects:
                found = self._stand_ins(final, effect)
                best = min(found, key=lambda n: found[n].heldout.loss.sum())
                if best != effect and paired(found[best].heldout, found[effect].heldout)[0] > 0.5:
                    swapped = self._rewhitened(found[best])
                    swapped.candidates = final.candidates
                    steps[-1] = swapped
                    self.watch(swapped, f"{best} in place of {effect}")
                    break
                reference = found[effect]
                alike = {
                    name: other
                    for name, other in found.items()
                    if name == effect or _alike(paired(reference.heldout, other.heldout), len(other.heldout.loss))
                }
                classes.append({effect: reference} | alike)
            else:
                return classes
        return classes

    def _stand_ins(self, final: Step, effect: str) -> dict[str, Step]:
        """The final model, and the models with another effect in the place of this one."""
        found = {effect: final}
        reduced = self._reduced(final, effect)
        if reduced is None:
            return found
        others = [n for n in self.names if n not in final.effects]
        scores = self._scores(reduced, [effect, *others])
        own = next(s.gain for s in scores if s.effect == effect)
        found |= self._refits(
            reduced, [s for s in scores if s.effect != effect and s.gain >= COMPARABLE * own], REFITTED
        )
        return found


def _certain(step: Step, effect: str) -> bool:
    """Whether Wald's test alone says that the effect is not idle, so that no refit need be spent on it."""
    declared, values = step.fit.model.declared, step.fit.values()
    away = {n: values[n] - p.none for n, p in declared.items() if n.startswith(f"{effect}.") and p.none is not None}
    place = [list(declared).index(label) for label in away]
    size = torch.tensor(list(away.values()), dtype=torch.float64)
    covariance = parameter_covariance(step)[place][:, place]
    return float(size @ torch.linalg.pinv(covariance, hermitian=True) @ size) > CERTAIN**2 * len(size)


def _alike(difference: tuple[float, float], groups: int) -> bool:
    """Whether a model predicts held-out states as well as a better one does: within one standard error of the paired
    difference, or with a difference in χ² that noise makes wherever two signatures coincide."""
    mean, error = difference
    return mean < error or mean * groups < COINCIDE


def _states(rows: Rows) -> Tensor:
    return torch.as_tensor(rows.state)


def select(rows: Rows, train: str) -> Rows:
    """Rows of a named set. Raises UserError."""
    sample = rows.states.sample.numpy()
    return rows[torch.as_tensor(np.flatnonzero(np.isin(sample, samples_of(train, sample))))]


def parameter_covariance(step: Step) -> Tensor:
    """Covariance of the declared physical parameters (SI), scaled by the noise that was found: (k, k)."""
    fit = step.fit
    jacobian = fit.jacobian.flatten(0, 1)
    length = norms(jacobian).clamp_min(1e-300)
    scaled = jacobian / length
    inverse = torch.linalg.pinv(scaled.T @ scaled, hermitian=True, rtol=1e-13) / length / length[:, None]

    def declared(vector: Tensor) -> Tensor:
        values = fit.model.physical(vector)
        return torch.stack([values[name] for name in fit.model.declared])

    if not fit.model.declared:
        return torch.zeros(0, 0)
    change = torch.func.jacfwd(declared)(fit.vector)
    return change @ inverse @ change.T * step.left.scale**2
