"""The best plan if visits could be made in any share, and what no plan of so many rows can exceed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog, minimize

from freelearn.queries.next_measurements.views import Matrices, Objective

# Rounds of adding visits, and the distance of value and bound that is close enough.
ROUNDS, CLOSE = 40, 2e-3
# Weights below this share of a visit are dropped.
NOTHING = 1e-6
# Places that the first shares are spread over, so that no coefficient is unknown at first; and the share that visits
# get when they are added.
SPREAD, NEW = 24, 0.1
# Visits kept for the exact plan to choose from, of each size.
POOL = 24


@dataclass(frozen=True)
class Continuous:
    """visits (c,) and how often each is made, weights (c,) ≥ 0. value: of the least view. bound: what no plan of the
    same rows and mountings can exceed; at the optimum both agree. weakest: how much each view counts there, (V,).
    pool: visits worth choosing from."""

    visits: np.ndarray
    weights: np.ndarray
    value: float
    bound: float
    weakest: np.ndarray
    pool: np.ndarray


def continuous(objective: Objective, rows: float, mountings: float, close: float = CLOSE) -> Continuous:
    """Shares of visits with `rows` rows in `mountings` visits at most that make the least view largest.

    By adding visits to the best shares of those that are in already, until the equivalence theorem (Kiefer & Wolfowitz
    1960, Fedorov 1972; for the least of several views Atkinson & Fedorov 1975) says that none would raise it: with Γ a
    slope of the objective, a plan of visits c with matrices G tells at most tr(Γ M₀) + Σ tr(Γ G), which no plan can
    raise beyond tr(Γ M₀) and the largest sum of sensitivities that so many rows and mountings allow. That bound holds
    wherever Γ was taken, so it certifies what was found, however it was found.
    """
    known = objective.known
    seen = objective.sensitivities(objective.slopes(known))
    support = np.union1d(_best_of_sizes(objective, seen), _spread(objective))
    weights = _within(np.full(len(support), 1.0), objective.visits.sizes_of(support), rows, mountings)
    best_bound, weakest = np.inf, np.full(len(seen), 1 / len(seen))
    found = 0.0
    for _ in range(ROUNDS):
        each = objective.each(support)
        weights = _shares(objective, each, support, weights, rows, mountings)
        now = _sum(known, each, weights)
        found = float(objective.values(now).min())
        slopes = objective.slopes(now)
        seen = objective.sensitivities(slopes)
        base = np.array([float(np.sum(u * (m @ u))) for u, m in zip(slopes, known, strict=True)])
        alpha = _weights_of_views(objective, seen, base, support, rows, mountings)
        total = _together(alpha, seen)
        bound = float(alpha @ base) + _most(objective, total, rows, mountings)
        if bound < best_bound:
            best_bound, weakest = bound, alpha
        if best_bound - found <= close * best_bound:
            break
        more = _best_of_sizes(objective, total[None])
        kept = weights > NOTHING
        new = np.setdiff1d(more, support[kept])
        added = NEW * weights[kept].sum() / max(len(new), 1)
        support = np.concatenate([support[kept], new])
        weights = np.concatenate([(1 - NEW) * weights[kept], np.full(len(new), added)])
        weights = _within(weights, objective.visits.sizes_of(support), rows, mountings)
    total = _together(weakest, seen)
    kept = weights > NOTHING
    pool = np.union1d(support[kept], _best_of_sizes(objective, total[None], POOL))
    return Continuous(support[kept], weights[kept], found, best_bound, weakest, pool)


def _sum(known: Matrices, each: Matrices, weights: np.ndarray) -> Matrices:
    return [m + np.tensordot(weights, g, 1) for m, g in zip(known, each, strict=True)]


def _together(weakest: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Sensitivities (V, P, S) of all views, each as much as it counts: (P, S), −∞ where a visit is not possible."""
    possible = np.isfinite(seen[0])
    return np.where(possible, np.tensordot(weakest, np.where(possible, seen, 0.0), 1), -np.inf)


def _best_of_sizes(objective: Objective, seen: np.ndarray, count: int = 1) -> np.ndarray:
    """Numbers of the visits that promise most, `count` of every size and view. seen: (V, P, S)."""
    visits, chosen = objective.visits, []
    for size in np.unique(visits.sizes):
        subsets = np.flatnonzero(visits.sizes == size)
        for view in seen:
            part = view[:, subsets].reshape(-1)
            top = np.argsort(-part, kind="stable")[:count]
            top = top[np.isfinite(part[top])]
            place, subset = np.divmod(top, len(subsets))
            chosen.append(place * len(visits.subsets) + subsets[subset])
    return np.unique(np.concatenate(chosen))


def _spread(objective: Objective) -> np.ndarray:
    """The largest visit of some places, far and wide."""
    visits = objective.visits
    sizes = np.where(visits.allowed, visits.sizes, 0)
    places = np.flatnonzero(sizes.max(1) > 0)
    some = places[np.unique(np.linspace(0, len(places) - 1, SPREAD).astype(np.int64))]
    return np.asarray(some * len(visits.subsets) + sizes[some].argmax(1))


def _most(objective: Objective, total: np.ndarray, rows: float, mountings: float) -> float:
    """Largest sum of sensitivities (P, S) with so many rows and mountings: a mixture of two sizes at most."""
    sizes, best = _largest_by_size(objective, total)
    most = 0.0
    for n, s in zip(sizes, best, strict=True):
        most = max(most, min(mountings, rows / n) * s)
        for other, t in zip(sizes, best, strict=True):
            if n * mountings < rows < other * mountings:
                share = (rows / mountings - n) / (other - n)
                most = max(most, mountings * ((1 - share) * s + share * t))
    return float(most)


def _largest_by_size(objective: Objective, total: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    sizes = np.unique(objective.visits.sizes)
    best = np.array([total[:, objective.visits.sizes == n].max() for n in sizes])
    return sizes[np.isfinite(best)], best[np.isfinite(best)]


def _weights_of_views(
    objective: Objective, seen: np.ndarray, base: np.ndarray, support: np.ndarray, rows: float, mountings: float
) -> np.ndarray:
    """How much each view counts, (V,), so that the bound over the supported visits is smallest: a linear program."""
    count = len(seen)
    if count == 1:
        return np.ones(1)
    scale = max(float(np.abs(base).max()), float(seen[np.isfinite(seen)].max(initial=0.0)), 1e-300)
    columns = seen.reshape(count, -1)[:, support].T / scale
    sizes = objective.visits.sizes_of(support).astype(np.float64)
    limits = np.concatenate([columns, -sizes[:, None], -np.ones((len(support), 1))], axis=1)
    cost = np.concatenate([base / scale, [rows, mountings]])
    one = np.concatenate([np.ones(count), [0.0, 0.0]])[None]
    solved = linprog(cost, limits, np.zeros(len(support)), one, [1.0], bounds=(0, None), method="highs")
    if not solved.success:
        return np.full(count, 1 / count)
    alpha = np.maximum(solved.x[:count], 0.0)
    return np.asarray(alpha / alpha.sum())


def _shares(
    objective: Objective, each: Matrices, support: np.ndarray, start: np.ndarray, rows: float, mountings: float
) -> np.ndarray:
    """How often the supported visits (c,) are best made, (c,): the largest t that every view reaches."""
    sizes = objective.visits.sizes_of(support).astype(np.float64)
    known = objective.known
    scale = max(float(objective.values(_sum(known, each, start)).max()), 1e-300)

    def values(x: np.ndarray) -> np.ndarray:
        return np.asarray(objective.values(_sum(known, each, np.maximum(x[:-1], 0.0))) / scale - x[-1])

    def rates(x: np.ndarray) -> np.ndarray:
        slopes = objective.slopes(_sum(known, each, np.maximum(x[:-1], 0.0)))
        by_weight = [np.einsum("kq,ckl,lq->c", u, g, u) for u, g in zip(slopes, each, strict=True)]
        return np.concatenate([np.stack(by_weight) / scale, -np.ones((len(by_weight), 1))], axis=1)

    limits = np.stack([np.append(sizes, 0.0), np.append(np.ones(len(sizes)), 0.0)])
    room = np.array([rows, mountings], dtype=np.float64)
    least = float((values(np.append(start, 0.0))).min())
    solved = minimize(
        lambda x: -x[-1],
        np.append(start, least),
        jac=lambda x: np.append(np.zeros(len(x) - 1), -1.0),
        bounds=[(0.0, None)] * len(start) + [(None, None)],
        constraints=[
            {"type": "ineq", "fun": values, "jac": rates},
            {"type": "ineq", "fun": lambda x: room - limits @ x, "jac": lambda x: -limits},
        ],
        method="SLSQP",
        options={"maxiter": 100, "ftol": 1e-9},
    )
    best = _within(np.maximum(solved.x[:-1], 0.0), sizes, rows, mountings)
    better = float(objective.values(_sum(known, each, best)).min()) >= float(
        objective.values(_sum(known, each, start)).min()
    )
    return best if better and np.isfinite(best).all() else start


def _within(weights: np.ndarray, sizes: np.ndarray, rows: float, mountings: float) -> np.ndarray:
    """Weights that use no more than there is."""
    used = max(float(weights @ sizes) / rows, float(weights.sum()) / mountings, 1e-300)
    return np.asarray(weights / used) if used > 1 else weights


def supported(found: Continuous) -> Sequence[tuple[int, float]]:
    """Visits and how often each is made, the most often first."""
    order = np.argsort(-found.weights)
    return [(int(found.visits[i]), float(found.weights[i])) for i in order]
