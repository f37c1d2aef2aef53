"""The plan: how many mountings, which visits, and how close that comes to the best there is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from freelearn.design.continuous import Continuous, continuous
from freelearn.design.exact import exact
from freelearn.design.objective import Objective
from freelearn.errors import UserError

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
