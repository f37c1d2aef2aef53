"""Left out and truly refitted: each level of what is imposed, each state, sample and member in turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from scipy.special import chdtri, ndtr, stdtrit
from torch import Tensor

from freelearn.common.formats import error_in_words, in_words
from freelearn.discovery.fits.journal import ahead
from freelearn.discovery.fits.left_out import unseen
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.shapes import imposed
from freelearn.discovery.referee.black_box import levels
from freelearn.discovery.referee.case import CANNOT, CERTIFIED, FAIL, PASS, Case, Check

# Errors of what was left out, beside the noise: as good, and beyond doubt worse; and beside what the others do not know
# of the parameters, which is a number or two, so that three standard deviations of it happen: so many where they are
# known, and of few parts, which hardly tell how large they are, as many as Student's t says for the same probability.
# Noise that is mostly the errors of a few places is exceeded more often than that of many readings: what it makes at
# most is a quantile of χ² of the same probability.
NEAR, SURE, UNSURE = 1.3, 1.6, 3.0
# Error between the outermost levels, beside the noise, beyond which nothing can be said.
FAR = 2.0
# A cubic polynomial wins where its error is smaller than this share of the model's.
CUBIC = 0.9
DEGREE = 3
# Quantities of which every level is left out; states, of a table with no levels, in so many parts.
MOST_WAYS = 3
FEWEST_STATES = 3


class Expected(NamedTuple):
    """E of noise alone, and of noise and what the other rows know of the parameters; draws: how many independent errors
    the noise is as good as (Case.draws)."""

    noise: float
    known: float
    draws: float

    def most(self, parts: int) -> float:
        """The error of so many parts beyond which neither explains it."""
        return self._most(SURE, parts)

    def most_of_few(self, parts: int) -> float:
        """The same where the noise is mostly the errors of few places: these exceed what is usual more often."""
        return self._most(max(SURE, math.sqrt(chdtri(self.draws, ndtr(-UNSURE)) / self.draws)), parts)

    def _most(self, sure: float, parts: int) -> float:
        unsure = math.sqrt(max(self.known**2 - self.noise**2, 0.0))
        return math.hypot(sure * self.noise, float(stdtrit(parts, ndtr(UNSURE))) * unsure)


@dataclass(frozen=True)
class LeftOut:
    """What one way of leaving rows out showed, errors E as fractions: of the model, of the plain one, of a cubic; what
    is expected, and with places that are off by as much as they may be, where the rows do not tell by how much. parts:
    E of each part, and its name."""

    way: str
    model: float
    plain: float | None
    cubic: float
    expected: Expected
    placed: Expected | None
    parts: Sequence[tuple[str, float]]

    @property
    def noise(self) -> float:
        """What noise alone makes."""
        return self.expected.noise

    @property
    def most(self) -> float:
        """The error beyond which neither noise nor parameters explain it."""
        return self.expected.most(len(self.parts))

    @property
    def most_of_few(self) -> float:
        """That beyond which few places do not either."""
        return self.expected.most_of_few(len(self.parts))

    @property
    def by_few(self) -> bool:
        """Whether it errs by more than noise usually makes, and by no more than that of so few places may make."""
        return self.most < self.model <= self.most_of_few

    @property
    def most_placed(self) -> float:
        """The same where places may be off by more than is assumed."""
        return self.placed.most(len(self.parts)) if self.placed else self.most


def levels_left_out(case: Case) -> tuple[list[Check], list[LeftOut]]:
    """Checks of every way, and what they showed."""
    ways = _ways(case)
    fits = [fit for fit in (case.fit, case.plain) if fit is not None]
    ahead([partial(_raw, case, fit, fold) for fold in ways.values() for fit in fits])
    found = [left for left in (_way(case, way, fold) for way, fold in ways.items()) if left is not None]
    if not found:
        says = "There is one level of everything that a bed imposes: nothing could be left out."
        return [Check("left out", CANNOT, None, None, says)], []
    checks = [_check(left) for left in found]
    # Of two samples one may say too little about the other: then other ways of leaving out decide.
    if any(c.result == PASS for c in checks):
        checks = [replace(c, decides=c.decides and c.result != CANNOT) for c in checks]
    return checks, found


def _ways(case: Case) -> dict[str, np.ndarray]:
    """Levels of what a bed imposes on states, samples, and whole states where they have no levels."""
    state = {quantity.name for quantity in case.rows.states.bed.state}
    found = {f"each {name}": level for name, level in levels(case).items() if name in state}
    samples, member = np.unique(case.rows.states.sample.numpy(), return_inverse=True)
    if len(samples) > 1:
        found["each sample"] = member
    if set(found) <= {"each sample"} and case.states >= FEWEST_STATES:
        found["states"] = case.fold
    if not found:
        found = {f"each {name}": level for name, level in levels(case).items()} or _thirds(case)
    return dict(list(found.items())[:MOST_WAYS])


def _thirds(case: Case) -> dict[str, np.ndarray]:
    """Of a table with one state, thirds of the pressure."""
    named = imposed(case.rows.states)
    name = next((n for n in named if n.startswith("pressure")), None)
    if name is None or len(case.rows) < 9:
        return {}
    values = named[name].numpy()
    edges = np.quantile(values, [1 / 3, 2 / 3])
    third = np.searchsorted(edges, values)
    return {f"thirds of {name}": third} if len(np.unique(third)) > 1 else {}


def _way(case: Case, way: str, fold: np.ndarray) -> LeftOut | None:
    numbers = np.unique(fold)
    parts = [fold == number for number in numbers]
    raw = _raw(case, case.fit, fold)
    cubic = _cubic(case, parts)
    if raw is None:
        return None
    plain = None if case.plain is None else _raw(case, case.plain, fold)
    owns = [torch.as_tensor(part.copy()) for part in parts]
    each = [(_named(case, way, part), case.error(raw, own)) for part, own in zip(parts, owns, strict=True)]
    unknown = [(own, case.covariance_from(~own)) for own in owns]
    placed = _expected(case, unknown, CERTIFIED) if case.places_assumed else None
    return LeftOut(
        way, case.error(raw), None if plain is None else case.error(plain), case.error(cubic),
        _expected(case, unknown), placed, each,
    )  # fmt: skip


def _expected(case: Case, unknown: Sequence[tuple[Tensor, Tensor]], places: float = 1.0) -> Expected:
    """What is expected of a right model. unknown: rows of each part (N,) bool, and the covariance (p, p) that the
    others leave. places: times that their errors are as large as they were found."""
    shares, counts = 0.0, 0
    for own, covariance in unknown:
        expected = case.expected(own, covariance, places)
        shares, counts = shares + int(own.sum()) * expected**2, counts + int(own.sum())
    every = torch.ones(len(case.rows), dtype=torch.bool)
    return Expected(case.expected(every, places=places), (shares / max(counts, 1)) ** 0.5, case.draws(places))


def _raw(case: Case, fit: WhiteFit, fold: np.ndarray) -> Tensor | None:
    """Residuals (N, 2) of each fold (N,) by a fit to the others; None where some have no answer."""
    raw = unseen(fit, case.rows, case.whiten, fold)
    return raw if bool(raw.isfinite().all()) else None


def _cubic(case: Case, parts: Sequence[np.ndarray]) -> Tensor:
    """Residuals (N, 2) of a cubic polynomial in all that is imposed, on the same parts; rows that hang loose apart."""
    from sklearn.linear_model import RidgeCV
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    states = case.rows.states
    named = [x.numpy() for x in imposed(states).values()]
    design = [states.reference_length, states.fiber_angle, states.inner_radius, states.outer_radius]
    named += [d.numpy() for d in design if float(d.max() - d.min()) > 0][:1]
    matrix = np.stack([x for x in named if np.ptp(x) > 0], axis=1)
    features = StandardScaler().fit_transform(
        PolynomialFeatures(DEGREE, include_bias=False).fit_transform(StandardScaler().fit_transform(matrix))
    )
    value = case.rows.readings.value.numpy()
    missed = np.zeros_like(value)
    for channel in range(2):
        there = case.present[:, channel].numpy() & ~case.rows.readings.slack.numpy()
        for part in parts:
            seen = there & ~part
            if seen.sum() < 4:
                continue
            fitted = RidgeCV(np.logspace(-6, 2, 9)).fit(features[seen], value[seen, channel])
            missed[part, channel] = np.where(there, fitted.predict(features) - value[:, channel], 0.0)[part]
    return torch.as_tensor(missed)


def _named(case: Case, way: str, part: np.ndarray) -> str:
    """A part in words: the level of what was left out."""
    states = case.rows.states
    if way == "each sample":
        return f"sample {int(states.sample[torch.as_tensor(part.copy())][0])}"
    for quantity in states.bed.state:
        if way == f"each {quantity.name}":
            value = float(imposed(states)[quantity.name][torch.as_tensor(part.copy())].mean()) / quantity.factor
            return f"{quantity.name} {in_words(value)}{quantity.suffix}"
    return way


def _check(left: LeftOut) -> Check:
    worst = max(left.parts, key=lambda part: part[1])
    beside = f"noise makes {error_in_words(left.noise)}, a cubic polynomial {error_in_words(left.cubic)}"
    if left.plain is not None:
        beside += f", the model without what was found {error_in_words(left.plain)}"
    name = f"{left.way} left out"

    def says(what: str) -> str:
        error = f"With {left.way} left out in turn the error is {error_in_words(left.model)}{what}"
        return f"{error} ({beside}; worst: {worst[0]}, {error_in_words(worst[1])})."

    if left.model <= NEAR * left.noise:
        return Check(name, PASS, left.model, NEAR * left.noise, says(""))
    if left.by_few:
        what = ", no more than the errors of so few places may make: set some twice"
        return Check(name, CANNOT, left.model, left.most, says(what))
    if left.model > left.most:
        if left.cubic < CUBIC * left.model:
            return Check(name, FAIL, left.model, left.cubic, says(", where a cubic polynomial predicts better"))
        if left.plain is not None and left.plain < left.model:
            what = ", where the model without what was found predicts better"
            return Check(name, FAIL, left.model, left.plain, says(what))
        what = ", more than noise and what is not known of the parameters make"
        if left.model > left.most_placed:
            return Check(name, FAIL, left.model, left.most, says(what))
        what += f", but no more than places off by {CERTIFIED:g} times what is usual: set some twice"
        return Check(name, CANNOT, left.model, left.most, says(what))
    what = ", as far as the other rows know the parameters"
    # Beyond the outermost levels any model may be far off; between them a claim has to hold.
    inner = [error for _, error in _between(left)]
    far = bool(inner) and (sum(e**2 for e in inner) / len(inner)) ** 0.5 > FAR * left.noise
    return Check(name, CANNOT, left.model, NEAR * left.noise, says(what), decides=far)


def _between(left: LeftOut) -> Sequence[tuple[str, float]]:
    """The parts that lie between others: all but the outermost levels."""
    levels = left.way.startswith("each ") and left.way != "each sample"
    return left.parts[1:-1] if levels and len(left.parts) > 2 else left.parts
