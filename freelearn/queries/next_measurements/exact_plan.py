"""Whole visits: a plan that can be measured, how many mountings it has, and how close it comes to the best there is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from freelearn.common.errors import UserError
from freelearn.queries.next_measurements.continuous_plan import Continuous, continuous, supported
from freelearn.queries.next_measurements.views import Matrices, Objective

# Whole visits: a plan that can be measured, exchanged visit by visit until no exchange helps.

# Passes of exchanges, and pairs of visits whose rows are divided anew in each.
PASSES, PAIRS = 12, 60
# Visits up to which a plan is exchanged for all there are in the end.
FEW = 12
# Plans drawn at random from the best shares, to start from too: exchanges end where none helps, which need not be best.
DRAWS = 6
# An exchange must raise the merit by this share.
WORTH = 1e-6


def exact(objective: Objective, ideal: Continuous, rows: int, mountings: int, seed: int) -> np.ndarray:
    """Numbers of the visits of a plan with just so many rows, in so many mountings at most.

    Fedorov's (1972) exchanges over whole visits, from the best shares as they round, as they are drawn at random, and
    from the best visit after the other; the best of all. A visit is exchanged for another of its size, or two of them
    divide their rows anew.
    """
    search = _Exchange(objective, ideal.pool, rows, mountings, np.random.default_rng([seed, 211]))
    starts = [search.filled(_fitting(objective, _rounded(ideal), rows, mountings)), search.filled([])]
    for _ in range(DRAWS):
        drawn = search.generator.choice(ideal.visits, mountings, p=ideal.weights / ideal.weights.sum())
        starts.append(search.filled(_fitting(objective, drawn.tolist(), rows, mountings)))
    plans = [search.improved(start) for start in starts]
    best = np.array(max(plans, key=search.merit), dtype=np.int64)
    return polished(objective, best) if len(best) <= FEW else best


def polished(objective: Objective, plan: np.ndarray) -> np.ndarray:
    """A plan of few visits after exchanges of each for any other of its size, also such as do not seem worth it."""
    plan = plan.copy()
    visits = objective.visits
    possible = np.flatnonzero(visits.allowed.reshape(-1))
    sizes = visits.sizes_of(possible)
    now = -np.inf
    for _ in range(PASSES):
        before = now
        for i in range(len(plan)):
            others = objective.each(np.delete(plan, i))
            rest = [m + g.sum(0) for m, g in zip(objective.known, others, strict=True)]
            rivals = np.append(plan[i], possible[sizes == visits.sizes_of(plan[i : i + 1])])
            each = objective.each(rivals)
            merits = objective.merit([m + g for m, g in zip(rest, each, strict=True)])
            top = int(np.argmax(merits))
            if merits[top] > merits[0] * (1 + WORTH):
                plan[i] = rivals[top]
            now = float(merits[top])
        if now <= before * (1 + WORTH) or len(plan) == 1:
            break
    return plan


def _rounded(ideal: Continuous) -> list[int]:
    """The whole parts of the best shares, then their fractions, the largest first."""
    pairs = supported(ideal)
    wanted = [visit for visit, weight in pairs for _ in range(int(weight))]
    return wanted + [visit for visit, _ in sorted(pairs, key=lambda pair: -(pair[1] % 1))]


def _fitting(objective: Objective, wanted: list[int], rows: int, mountings: int) -> list[int]:
    """Those of some visits that rows and mountings allow."""
    plan: list[int] = []
    used = 0
    for visit, size in zip(wanted, objective.visits.sizes_of(np.array(wanted)).tolist(), strict=True):
        left = mountings - len(plan) - 1
        if left >= 0 and used + size <= rows <= used + size + left * objective.visits.largest:
            plan.append(visit)
            used += size
    return plan


class _Exchange:
    def __init__(
        self, objective: Objective, pool: np.ndarray, rows: int, mountings: int, generator: np.random.Generator
    ) -> None:
        self.objective, self.rows, self.mountings, self.generator = objective, rows, mountings, generator
        self.pool = pool
        self.sizes = objective.visits.sizes_of(pool)
        self.each = objective.each(pool)
        self.place = {int(visit): i for i, visit in enumerate(pool)}

    def total(self, plan: Iterable[int]) -> Matrices:
        """What is known and a plan of visits of the pool tell together."""
        numbers = [self.place[visit] for visit in plan]
        return [m + g[numbers].sum(0) for m, g in zip(self.objective.known, self.each, strict=True)]

    def merit(self, plan: Iterable[int]) -> float:
        """Of a plan."""
        return float(self.objective.merit(self.total(plan)))

    def best(self, before: Matrices, size: int) -> tuple[int, float]:
        """The visit of a size that raises the merit most, and the merit then."""
        numbers = np.flatnonzero(self.sizes == size)
        if not len(numbers):
            return -1, -np.inf
        merits = self.objective.merit([m + g[numbers] for m, g in zip(before, self.each, strict=True)])
        top = int(np.argmax(merits))
        return int(self.pool[numbers[top]]), float(merits[top])

    def filled(self, plan: list[int]) -> list[int]:
        """The plan with visits added, each the best one by itself, until it has all its rows."""
        plan = list(plan)
        while (left := self.rows - self._rows(plan)) > 0:
            free = self.mountings - len(plan)
            if free <= 0:
                # No mounting is free: the smallest visit makes room.
                plan.remove(min(plan, key=lambda visit: self._rows([visit])))
                continue
            size = min(-(-left // free), self.objective.visits.largest)
            visit, _ = self.best(self.total(plan), size)
            plan.append(visit)
        return plan

    def improved(self, plan: list[int]) -> list[int]:
        """The plan after exchanges, until none helps."""
        now = self.merit(plan)
        for _ in range(PASSES):
            before = now
            for i in range(len(plan)):
                without = self.total(plan[:i] + plan[i + 1 :])
                visit, merit = self.best(without, self._rows([plan[i]]))
                if merit > now * (1 + WORTH):
                    plan, now = [*plan[:i], visit, *plan[i + 1 :]], merit
            plan, now = self._divided(plan, now)
            if now <= before * (1 + WORTH):
                break
        return plan

    def _divided(self, plan: list[int], now: float) -> tuple[list[int], float]:
        """Pairs of visits that divide their rows anew, or become one."""
        pairs = [(i, j) for i in range(len(plan)) for j in range(i)]
        if len(pairs) > PAIRS:
            pairs = [pairs[k] for k in self.generator.choice(len(pairs), PAIRS, replace=False)]
        for i, j in pairs:
            if max(i, j) >= len(plan):
                continue
            rest = [visit for k, visit in enumerate(plan) if k not in (i, j)]
            without, rows = self.total(rest), self._rows([plan[i], plan[j]])
            for size in range(rows // 2 + 1):
                two, merit = self._both(without, rows - size, size)
                if merit > now * (1 + WORTH):
                    plan, now = [*rest, *two], merit
                    break
        # A free mounting takes some rows of a visit.
        for i in range(len(plan)):
            if len(plan) >= self.mountings or self._rows([plan[i]]) < 2:
                continue
            rest = plan[:i] + plan[i + 1 :]
            two, merit = self._both(self.total(rest), self._rows([plan[i]]) - 1, 1)
            if merit > now * (1 + WORTH):
                plan, now = [*rest, *two], merit
        return plan, now

    def _both(self, without: Matrices, size: int, other: int) -> tuple[list[int], float]:
        one, merit = self.best(without, size)
        if one < 0 or not other:
            return [one], merit
        added = [m + g[self.place[one]] for m, g in zip(without, self.each, strict=True)]
        two, merit = self.best(added, other)
        return [one, two], merit

    def _rows(self, plan: list[int]) -> int:
        return int(sum(self.sizes[self.place[visit]] for visit in plan))


# The plan: how many mountings, which visits, and how close that comes to the best there is.

# Distance of value and bound that is close enough to compare numbers of mountings by.
ROUGHLY = 0.02
# Times as many rows beyond which none are worth saying, rows below which they are not either, and how near is enough
# (as a logarithm). Looks at most, the powers of the number of rows that what they add may follow, and how far a look
# may lie from the last one (as a logarithm).
MOST_TIMES, LEAST, NEAR = 1e3, 0.2, 0.05
LOOKS, POWERS, FAR = 6, (0.3, 2.0), 4.0


@dataclass(frozen=True)
class Chosen:
    """visits: numbers of a plan's, one for each mounting. ideal: the best shares of the same rows and mountings."""

    visits: np.ndarray
    ideal: Continuous


def choose(objective: Objective, rows: int, per_state: int | None, mounting_rows: float, seed: int) -> Chosen:
    """Visits of `rows` rows. per_state: rows of each mounting; None: the number of mountings with the most gain for its
    cost, of which a mounting is `mounting_rows` rows'. Raises UserError where nothing can be reached."""
    largest = objective.visits.largest
    if not largest:
        raise UserError("The models have no answer anywhere within the bed's reach: there is nothing to plan.")
    mountings = -(-rows // min(per_state or 0, largest)) if per_state else _mountings(objective, rows, mounting_rows)
    ideal = continuous(objective, rows, mountings)
    visits = exact(objective, ideal, rows, mountings, seed)
    if mountings == 1:
        ideal = replace(ideal, bound=min(ideal.bound, _best_visit(objective, rows)))
    return Chosen(visits, ideal)


def _best_visit(objective: Objective, rows: int) -> float:
    """What the best single visit tells, all of them looked at: a bound that can be reached."""
    visits = np.flatnonzero(objective.visits.allowed.reshape(-1))
    each = objective.each(visits[objective.visits.sizes_of(visits) == rows])
    return float(objective.values([m + g for m, g in zip(objective.known, each, strict=True)]).min(0).max())


def _mountings(objective: Objective, rows: int, mounting_rows: float) -> int:
    before = float(objective.values(objective.known).min())
    largest = objective.visits.largest
    options = sorted({-(-rows // each) for each in range(1, largest + 1)})
    worth = []
    for count in options:
        gain = continuous(objective, rows, count, ROUGHLY).value - before
        worth.append(gain / (rows + mounting_rows * count))
    return options[int(np.argmax(worth))]


def rows_for(objective: Objective, rows: int, mountings: int, goal: float) -> float:
    """About how many rows the best plan needs until its least view reaches `goal`, with as many mountings to a row as
    here; infinite beyond reason. By secants: what rows add is nearly a power of their number."""
    before = float(objective.values(objective.known).min())
    if before >= goal:
        return 0.0
    times, power = 1.0, 1.0
    seen: list[tuple[float, float]] = []
    for _ in range(LOOKS):
        gain = continuous(objective, rows * times, mountings * times, ROUGHLY).value - before
        missing = float(np.log((goal - before) / max(gain, 1e-300)))
        if abs(missing) < NEAR:
            break
        seen.append((float(np.log(times)), missing))
        if len(seen) > 1:
            (x, y), (z, w) = seen[-2:]
            power = float(np.clip((y - w) / (z - x), *POWERS))
        times *= float(np.exp(np.clip(missing / power, -FAR, FAR)))
        if times > MOST_TIMES or rows * times < LEAST:
            break
    return float("inf") if times > MOST_TIMES else max(rows * times, LEAST)
