"""Does a black box see anything in what is left?

A ridge regression on polynomials and splines of every column there is tries to predict the residuals of rows, states,
levels and samples that it has not seen. What it explains of residuals that are noise, made by the same fit, is what
noise may look like.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from freelearn.discovery.noise.linear_algebra import left_over
from freelearn.discovery.noise.shapes import imposed
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, Case, Check

# Draws of noise; standard deviations of what is explained of them beyond which noise does not explain it; share of the
# residuals' squares below which it does not matter; share that noise may seem to have, above which nothing is told.
DRAWS, SIGMAS, MATTERS, HIDES = 25, 4.0, 0.08, 0.4
# The same where readings scatter more than was stated. Worse sensors or a misfit that looks like noise: where nothing
# else speaks for the former, less has to be seen to speak for the latter.
SUSPECT_SIGMAS, SUSPECT_MATTERS = 3.0, 0.04
# What is seen has to be more than nearly all of so many more draws of noise look like: a regression that mostly sees
# nothing in noise sees much in few draws, of which a mean and a deviation of some tell nothing. Of many rows it sees so
# little in noise that some are enough.
MORE_DRAWS, CHANCE = 400, 0.01
# Shares of the rows that are left out in turn; of so many rows fewer tell as much.
FOLDS, FEWER, MANY_ROWS = 10, 5, 500
DEGREE, KNOTS = 3, 5
# Weights of the ridge to choose from, on columns of variance one: the last leaves nothing of any.
RIDGES = tuple(10.0**k for k in range(-1, 6))
# Residuals are drawn in to so many standard deviations.
DRAWN_IN = 4.0
# Levels of an imposed quantity that are left out one by one: no fewer, and no more.
FEWEST_LEVELS, MOST_LEVELS = 3, 14
FEWEST_ROWS = 24


@dataclass(frozen=True)
class Seen:
    """share: of the squared residuals that is explained where it was not seen, of the readings (the first) and of draws
    of noise."""

    share: float
    noise: np.ndarray

    def hidden(self, sigmas: float = SIGMAS) -> float:
        """Share that would have to be there to be seen, so many standard deviations beyond what noise looks like."""
        return float(self.noise.mean() + sigmas * max(self.noise.std(), 1e-6))


def black_box(case: Case, seed: int = 0) -> list[Check]:
    """One check for each way of leaving rows out."""
    if int(case.present.any(1).sum()) < FEWEST_ROWS:
        says = f"{int(case.present.any(1).sum())} rows are too few for a regression of what is left."
        return [Check("black box", CANNOT, None, None, says)]
    named = inputs(case)
    target = residuals(case, np.random.default_rng([seed, 28]))
    folds = ways(case, seed)
    whole = columns(named, case)
    checks = []
    for way, fold in folds.items():
        seen = explained(case, whole, target, fold)
        checks.append(_check(case, way, seen, named, target, fold, whole))
    return checks


def _check(
    case: Case, way: str, seen: Seen, named: Mapping[str, np.ndarray], target: np.ndarray, fold: np.ndarray,
    whole: np.ndarray,
) -> Check:  # fmt: skip
    name, suspect = f"black box, {way} left out", case.scatters_more
    hidden = seen.hidden(SUSPECT_SIGMAS if suspect else SIGMAS)
    least = max(hidden, SUSPECT_MATTERS if suspect else MATTERS)
    percent = f"{100 * max(seen.share, 0.0):.0f} % of what is left, where {100 * hidden:.0f} % would be seen"
    says = f"A regression predicts {percent}, on {way} left out"
    if seen.share > least:
        few = len(case.rows) < MANY_ROWS
        if few and (chance := _chance(case, whole, fold, seen.share)) > CHANCE:
            says += f": so it does of {100 * chance:.0f} of a hundred draws of noise."
            return Check(name, PASS, seen.share, least, says)
        says += f"; it depends on {depends_on(case, named, target, fold)}."
        if suspect and seen.share <= max(seen.hidden(), MATTERS):
            says += " Beside readings that scatter no more than you say it would be let pass."
        return Check(name, FAIL, seen.share, least, says)
    if seen.hidden() > HIDES:
        noise = f"On {way} left out, noise alone could look like {100 * seen.hidden():.0f} % of what is left."
        return Check(name, CANNOT, seen.share, seen.hidden(), noise, decides=way == "rows")
    return Check(name, PASS, seen.share, least, f"{says}.")


def _chance(case: Case, features: np.ndarray, fold: np.ndarray, share: float) -> float:
    """That as much is explained of noise."""
    noise = residuals(case, np.random.default_rng([len(fold), 30]), MORE_DRAWS)
    return float((explained(case, features, noise, fold).noise >= share).mean())


def inputs(case: Case) -> dict[str, np.ndarray]:
    """Every input of the rows by name, (N,) each, if it varies: what is imposed, order, time, what is predicted."""
    states = case.rows.states
    named = {name: x.detach().numpy() for name, x in imposed(states).items()}
    named["direction of the pressure change"] = states.direction.numpy()
    named["order of measuring"] = np.arange(len(states), dtype=float)
    named["time"] = states.clock.numpy()
    if states.recording is not None:
        named["time within the recording"] = states.dwell.numpy()
    for number, quantity in enumerate(states.bed.readings):
        if bool(case.present[:, number].any()):
            named[f"predicted {quantity.name}"] = case.fit.shown[:, number].numpy()
    return {name: x for name, x in named.items() if np.ptp(x) > 1e-9 * max(np.abs(x).max(), 1e-300)}


def residuals(case: Case, generator: np.random.Generator, draws: int = DRAWS) -> np.ndarray:
    """Whitened residuals and draws of noise that the same fit has absorbed its part of, (N, 2, 1 + draws), drawn in."""
    jacobian = case.fit.jacobian.flatten(0, 1)
    scatter = case.whiten.scatter
    size = jacobian.shape[0], draws
    freedom = scatter.tails.freedom if scatter is not None else np.inf
    drawn = generator.standard_t(freedom, size) if np.isfinite(freedom) else generator.standard_normal(size)
    noise = torch.as_tensor(drawn) * case.present.reshape(-1, 1)
    both = torch.cat([case.fit.residual.reshape(-1, 1), left_over(noise, jacobian)], dim=1).numpy()
    there = case.present.reshape(-1).numpy()
    size_of = 1.4826 * np.median(np.abs(both[there]), axis=0)
    both = np.clip(both, -DRAWN_IN * size_of, DRAWN_IN * size_of) / np.maximum(size_of, 1e-12)
    whole: np.ndarray = both.reshape(len(case.rows), 2, -1)
    return whole


def ways(case: Case, seed: int) -> dict[str, np.ndarray]:
    """Folds (N,) by what is left out: rows at random, whole states, levels of what is imposed, samples."""
    generator = np.random.default_rng([seed, 29])
    count = len(case.rows)
    shares = FOLDS if count < MANY_ROWS else FEWER
    found = {"rows": generator.permutation(count) % shares}
    states, member = np.unique(case.rows.state, return_inverse=True)
    if len(states) >= FEWEST_LEVELS:
        found["states"] = (generator.permutation(len(states)) % min(shares, len(states)))[member]
    for name, fold in levels(case).items():
        found[f"levels of {name}"] = fold
    samples, member = np.unique(case.rows.states.sample.numpy(), return_inverse=True)
    if len(samples) > 1:
        found["samples"] = member
    return found


def levels(case: Case) -> dict[str, np.ndarray]:
    """The level (N,) of each imposed quantity that has a few."""
    found = {}
    for name, x in imposed(case.rows.states).items():
        values = x.numpy()
        spread = np.ptp(values)
        if spread <= 0:
            continue
        _, level = np.unique((values / (1e-3 * spread)).round(), return_inverse=True)
        if FEWEST_LEVELS <= level.max() + 1 <= MOST_LEVELS:
            found[name] = level
    return found


def columns(named: Mapping[str, np.ndarray], case: Case, only: str | None = None) -> np.ndarray:
    """Polynomials of all inputs together, and splines of each, (N, k), of variance one. only: of one input alone."""
    from sklearn.preprocessing import PolynomialFeatures, SplineTransformer, StandardScaler

    chosen = {name: x for name, x in named.items() if only in (None, name)}
    matrix = StandardScaler().fit_transform(np.stack(list(chosen.values()), axis=1))
    wide = matrix.shape[1] <= 6
    parts = [PolynomialFeatures(DEGREE if wide else 2, include_bias=False).fit_transform(matrix)]
    parts.append(SplineTransformer(n_knots=KNOTS, degree=3, include_bias=False).fit_transform(matrix))
    samples = np.unique(case.rows.states.sample.numpy())
    if only is None and 1 < len(samples) <= FOLDS:
        own = (case.rows.states.sample.numpy()[:, None] == samples[None, :-1]).astype(float)
        parts.append(np.concatenate([own, *(own * x[:, None] for x in matrix.T)], axis=1))
    scaled: np.ndarray = StandardScaler().fit_transform(np.concatenate(parts, axis=1))
    return scaled


def explained(case: Case, features: np.ndarray, target: np.ndarray, fold: np.ndarray) -> Seen:
    """What the columns explain of the targets (N, 2, d) in folds (N,) that they were not fitted to."""
    before, after = np.zeros(target.shape[2]), np.zeros(target.shape[2])
    for channel in range(2):
        there = case.present[:, channel].numpy()
        if there.sum() < FEWEST_ROWS:
            continue
        y = target[there, channel]
        missed = y - _unseen(features[there], y, fold[there])
        before += (y**2).sum(0)
        after += (missed**2).sum(0)
    share = 1 - after / np.maximum(before, 1e-300)
    return Seen(float(share[0]), share[1:] if len(share) > 1 else np.zeros(1))


def _unseen(x: np.ndarray, y: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Predictions of targets y (n, d) by ridge regressions on x (n, k), each fold (n,) by one that did not see it.

    The weights are chosen once, on all rows, by leaving each out; every fold then costs one set of equations a weight.
    """
    from sklearn.linear_model import RidgeCV

    weights = np.broadcast_to(RidgeCV(RIDGES, alpha_per_target=True).fit(x, y).alpha_, y.shape[1])
    predicted = np.zeros_like(y)
    for number in np.unique(fold):
        out = fold == number
        if out.all():
            continue
        middle, level = x[~out].mean(0), y[~out].mean(0)
        centered = x[~out] - middle
        gram, shared = centered.T @ centered, centered.T @ (y[~out] - level)
        for weight in np.unique(weights):
            own = weights == weight
            slope = np.linalg.solve(gram + weight * np.eye(len(gram)), shared[:, own])
            predicted[np.ix_(out, own)] = level[own] + (x[out] - middle) @ slope
    return predicted


def depends_on(case: Case, named: Mapping[str, np.ndarray], target: np.ndarray, fold: np.ndarray) -> str:
    """The input that alone explains most."""
    alone = {name: explained(case, columns(named, case, name), target[..., :1], fold).share for name in named}
    best = max(alone, key=lambda name: alone[name])
    if alone[best] <= MATTERS / 2:
        return "several inputs together"
    return f"{best} ({100 * alone[best]:.0f} % by it alone)"
