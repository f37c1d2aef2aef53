"""Every form at every place, of every input or two: what each promises, by linear least squares on the residuals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
import torch
from scipy.special import chdtrc
from torch import Tensor

from freelearn.common.cores import side_by_side
from freelearn.data.rows import Rows
from freelearn.discovery.fits.derivatives import Build, none_vector
from freelearn.discovery.fits.white_fit import ONE as UNIT
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.proposals.proposal import Guess
from freelearn.discovery.proposals.pushes import Pushes
from freelearn.discovery.thresholds import SECOND_INPUT
from freelearn.fitting.problem import Problem
from freelearn.physics.effects.registry import lent
from freelearn.physics.written.forms import ENERGIES, ONE, TWO, Form
from freelearn.physics.written.places import Input, Place, told_elsewhere
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import Written

# Every form with every choice of its shapes, as columns: what each term is in every row.

# Of a form and one choice of its shapes, the values of its terms.
Evaluate = Callable[[Form, dict[str, float]], Sequence[Tensor]]


@dataclass(frozen=True)
class Terms:
    """forms: those tried; of: number of each trial's form, (t,); shapes: each trial's; first, second: places of its
    columns, (t,), the second's that of the first where it has one term alone. values: the columns, (…, k)."""

    forms: Sequence[Form]
    of: np.ndarray
    shapes: list[dict[str, float]]
    first: np.ndarray
    second: np.ndarray
    values: Tensor

    @classmethod
    def of_forms(cls, forms: Sequence[Form], signed: bool, evaluate: Evaluate) -> Terms:
        """All trials of some forms. signed: whether every input has values of both signs."""
        usable = [form for form in forms if signed or not form.signed]
        of, shapes, first, second = list[int](), list[dict[str, float]](), list[int](), list[int]()
        columns: list[Tensor] = []
        for number, form in enumerate(usable):
            for choice in form.grid():
                of.append(number)
                shapes.append(choice)
                first.append(len(columns))
                columns += evaluate(form, choice)
                second.append(len(columns) - 1)
        return cls(usable, np.array(of), shapes, np.array(first), np.array(second), torch.stack(columns, dim=-1))

    def gains(self, gram: Gram) -> tuple[np.ndarray, np.ndarray]:
        """Reduction of the sum of squares by each trial, (t,), and its amounts, (t, 2), the second zero where there is
        none. A trial that can hardly be seen, or whose terms are one,
        promises nothing."""
        a, b = gram.square[self.first], gram.square[self.second]
        two = self.first != self.second
        c = np.where(two, gram.product(self.first, self.second), 0.0)
        u, v = gram.slopes[self.first], np.where(two, gram.slopes[self.second], 0.0)
        det = a * b - c**2
        seen = gram.seen[self.first] & gram.seen[self.second] & (~two | (det > 1e-9 * a * b))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = np.where(two, (b * u - c * v) / det, u / a)
            y = np.where(two, (a * v - c * u) / det, 0.0)
            gain = np.where(seen, x * u + y * v, -np.inf)
        return gain, -np.stack([x, y], axis=1)

    def best(self, worth: np.ndarray) -> Iterator[tuple[Form, int]]:
        """Of each form its most worthy trial. worth: (t,)."""
        for number, form in enumerate(self.forms):
            own = np.flatnonzero(self.of == number)
            one = int(own[np.argmax(worth[own])])
            if np.isfinite(worth[one]):
                yield form, one


@dataclass(frozen=True)
class Gram:
    """What least squares need of whitened columns (2N, k), cleared of what the fit absorbs: their squared lengths and
    their products with the residuals, (k,) each; whether enough of each is left, (k,) bool."""

    columns: Tensor
    square: np.ndarray
    slopes: np.ndarray
    seen: np.ndarray

    def product(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Products of pairs of columns, (t,); only of those that differ."""
        out = np.zeros(len(first))
        pairs = np.flatnonzero(first != second)
        if len(pairs):
            a, b = self.columns[:, first[pairs]], self.columns[:, second[pairs]]
            out[pairs] = (a * b).sum(0).numpy()
        return out


# Below this share of its length a column is what the fit absorbs.
ABSORBED = 1e-4

Inputs = tuple[Input, ...]


class Looked(NamedTuple):
    """Guesses, and how many forms with all their shapes they were chosen from."""

    guesses: list[Guess]
    tried: int


class Scan:
    """The residuals of a fit and what the fit absorbs, looked at through columns. variance: of the whitened noise."""

    def __init__(self, fit: WhiteFit, rows: Rows, whiten: Whitener, variance: float, build: Build) -> None:
        self.fit, self.rows, self.whiten, self.variance, self.build = fit, rows, whiten, variance, build
        self.span = orthonormal(fit.jacobian.flatten(0, 1))

    def guesses(self, pushes: Pushes, pairs: bool = True) -> list[Guess]:
        """One for each place, inputs and form, the most promising shapes; best first. pairs: of inputs too.

        The chance of each is that of noise, times the forms that were tried with all their shapes (Bonferroni)."""
        told = [place for place in pushes.places if place.energy and pushes.told(place.inputs[0])]
        jobs = [partial(self._energy, place, pushes) for place in told]
        jobs += [partial(self._of_inputs, inputs, pushes) for inputs in _sets(pushes, pairs)]
        looked = side_by_side(jobs)
        tried = sum(count for _, count in looked)
        found = sorted((guess for guesses, _ in looked for guess in guesses), key=lambda g: -g.worth)
        return [replace(g, p_value=min(1.0, tried * float(chdtrc(g.form.count, g.gain)))) for g in found]

    def _of_inputs(self, inputs: Inputs, pushes: Pushes) -> Looked:
        """Every form of these inputs, at every place that has them."""
        scaled = [pushes.scaled(i) for i in inputs]
        signed = all(pushes.signed(i) for i in inputs)
        forms = resolvable(ONE if len(inputs) == 1 else TWO, inputs, pushes)
        terms = Terms.of_forms(forms, signed, partial(_values, scaled))
        # What acts on an end block sees its own inputs: the mean of its actuators' pressures.
        whole = [x.mean(1, keepdim=True) for x in scaled]
        of_block = Terms.of_forms(forms, signed, partial(_values, whole)) if self.rows.states.members else terms
        looked = list[Looked]()
        for place in pushes.places:
            if place.energy or not set(inputs) <= set(place.inputs) or told_elsewhere(place, inputs):
                continue
            if place.potential:
                looked += [self._potential(place, inputs, pushes, signed)] if len(inputs) == 2 else []
                continue
            by = pushes.by[place.name]
            if by.shape[2] == 1:
                looked.append(self._best(place, inputs, of_block, by * of_block.values, pushes))
            else:
                columns = torch.einsum("ncm,nmk->nck", by, terms.values)
                looked.append(self._best(place, inputs, terms, columns, pushes))
        return Looked([guess for guesses, _ in looked for guess in guesses], sum(count for _, count in looked))

    def _potential(self, place: Place, inputs: Inputs, pushes: Pushes, signed: bool) -> Looked:
        """Its loads are pushes along and about the axis."""
        scaled = [pushes.scaled(i)[:, 0] for i in inputs]
        scales = [pushes.scales[i.name] for i in inputs]
        terms = Terms.of_forms(
            resolvable(TWO, inputs, pushes), signed, lambda form, shapes: _slopes(form, scaled, shapes, scales)
        )
        along, about = (pushes.by[f"parallel {where}"].sum(-1)[..., None] for where in ("axial", "torsional"))
        return self._best(place, inputs, terms, along * terms.values[:, :1] + about * terms.values[:, 1:], pushes)

    def _energy(self, place: Place, pushes: Pushes) -> Looked:
        """All terms at once: they are linear in their amounts, and the wall's integrals are taken together."""
        (of,) = place.inputs
        templates: list[str] = []

        def template(form: Form, shapes: dict[str, float]) -> list[Tensor]:
            own = {name: f"({value!r})" for name, value in shapes.items()}
            templates.extend(term.format(x="{x}", **own) for term in form.terms)
            return [torch.zeros(0)] * len(form.terms)

        terms = Terms.of_forms(ENERGIES, pushes.signed(of), template)
        every = Written(place, (of,), (pushes.scales[of.name],), Form("every", "every", tuple(templates), ""), {})
        kind = effect_class(every)
        with lent([kind]):
            model = self.build([kind.name])
            raw = Problem(model, self.rows, UNIT).jacobians(none_vector(model, self.fit)[None])[0]
            places = [i for i, label in enumerate(model.labels()) if label.startswith(f"{kind.name}.")]
        return self._best(place, (of,), terms, raw.reshape(len(self.rows), 2, -1)[:, :, places], pushes)

    def _best(self, place: Place, inputs: Inputs, terms: Terms, columns: Tensor, pushes: Pushes) -> Looked:
        """Of each form the shapes that promise most."""
        gains, amounts = terms.gains(self._gram(columns))
        gains = gains / self.variance
        prices = np.array([price(form.count, len(inputs), self.whiten.count) for form in terms.forms])
        worth = gains - prices[terms.of]
        scales = tuple(pushes.scales[i.name] for i in inputs)
        guesses = []
        for form, one in terms.best(worth):
            own = tuple(amounts[one][: len(form.terms)].tolist())
            gain, promised = float(gains[one]), float(worth[one])
            guesses.append(Guess(place, inputs, form, gain, promised, scales, own, terms.shapes[one]))
        return Looked(guesses, len(terms.of))

    def _gram(self, columns: Tensor) -> Gram:
        white = self.whiten(columns).flatten(0, 1).nan_to_num_(0.0, 0.0, 0.0)
        before = white.square().sum(0)
        white = white.addmm_(self.span, self.span.T @ white, alpha=-1)
        after = white.square().sum(0)
        seen = (after > ABSORBED**2 * before) & (before > 0)
        return Gram(white, after.numpy(), (white.T @ self.fit.residual.reshape(-1)).numpy(), seen.numpy())


def price(constants: int, inputs: int, readings: int) -> float:
    """What a form has to explain of χ², in units of the noise's, to be worth its constants (Schwarz 1978), and a second
    input: there are several times as many pairs."""
    each = math.log(max(readings, 2))
    return each * constants + (SECOND_INPUT + each) * (inputs - 1)


def _sets(pushes: Pushes, pairs: bool) -> list[Inputs]:
    """Inputs alone, and in twos, on which something unknown at some place may depend."""
    known = [i for i in dict.fromkeys(i for p in pushes.places if not p.energy for i in p.inputs) if pushes.told(i)]
    alone: list[Inputs] = [(i,) for i in known]
    if not pairs:
        return alone
    return alone + [
        pair for pair in combinations(known, 2) if any(set(pair) <= set(p.inputs) for p in pushes.places)
    ]  # fmt: skip


def resolvable(forms: Sequence[Form], inputs: Inputs, pushes: Pushes) -> list[Form]:
    """The forms, no quicker than the inputs' levels tell, without those that these tell nothing about."""
    levels = [pushes.levels(i).tolist() for i in inputs]
    return [form for form in (form.told_by(levels) for form in forms) if form.has_room]


def _values(scaled: list[Tensor], form: Form, shapes: dict[str, float]) -> list[Tensor]:
    return form.values(scaled, shapes)


def _slopes(form: Form, scaled: list[Tensor], shapes: dict[str, float], scales: list[float]) -> list[Tensor]:
    """What each term of a potential of elongation and twist changes of force and moment, (N, 2) each."""
    inputs = [x.detach().requires_grad_() for x in scaled]
    with torch.enable_grad():
        terms = form.values(inputs, shapes)
        parts = [torch.autograd.grad(term.sum(), inputs, retain_graph=True, materialize_grads=True) for term in terms]
    return [torch.stack([-g / s for g, s in zip(part, scales, strict=True)], -1) for part in parts]
