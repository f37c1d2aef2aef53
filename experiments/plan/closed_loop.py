"""From a class of two to one effect: by planned rows, and by a grid in order and at random."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from first_look import ACCURACY, REACH, Truth, first_look, model, searched, usable

from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.search.next_states import PRESSURES, reach
from freelearn.discovery.thresholds import COINCIDE
from freelearn.queries.next_measurements.candidates import candidates, ordered
from freelearn.queries.next_measurements.exact_plan import choose, rows_for
from freelearn.queries.next_measurements.goals import Discriminate, score
from freelearn.queries.next_measurements.known_rows import Known

# χ² by which one member is ahead of the other once the class is split: three standard deviations of one number.
SPLIT = 9.0
# Rows that a plan may have: the fewest that are expected to split the class. Plans one after the other, before a class
# is given up.
ROWS, ROUNDS = (1, 2, 3, 4, 6, 8, 12, 16), 12
# Rows beyond which a class counts as one that cannot be told within reach.
TELLABLE = 50.0
# A grid is looked at after so many times as many states each time.
STRIDE = 1.15


@dataclass(frozen=True)
class Contest:
    """A class of two on a table. members: the true effect first, each with its fit. ahead: χ² by which the truth is
    ahead."""

    known: Known
    members: dict[str, WhiteFit]

    @classmethod
    def from_fits(cls, table: pd.DataFrame, effects: dict[str, list[str]], vectors: dict[str, torch.Tensor]) -> Contest:
        """effects: of each member's model; vectors: raw, where fits start."""
        own, rows = usable(table)
        names = list(effects)
        known = Known.from_rows(own, rows, model(own, effects[names[0]]), vectors[names[0]], ACCURACY)
        fits = {names[0]: known.fit}
        fits[names[1]] = known.fitted(model(own, effects[names[1]]), vectors[names[1]])
        return cls(known, fits)

    @property
    def ahead(self) -> float:
        """χ² of the rival beyond that of the truth."""
        truth, rival = (fit.chi2 for fit in self.members.values())
        return rival - truth

    @property
    def split(self) -> bool:
        """Whether one of the two is ahead for good."""
        return abs(self.ahead) >= SPLIT

    def after(self, table: pd.DataFrame, effects: dict[str, list[str]]) -> Contest:
        """On a longer table."""
        return Contest.from_fits(table, effects, {name: fit.vector for name, fit in self.members.items()})


def examine(number: int, whole_search: bool) -> dict:
    """One first look and, where it ends in a class of two with the truth, how many rows split it."""
    torch.set_num_threads(1)
    truth, table, effect = first_look(number)
    found = searched(table, number)
    result = {"number": number, "hidden": effect, "verdict": found.verdict, "classes": [list(c) for c in found.classes]}
    classes = [c for c in found.classes if len(c) > 1]
    right = len(found.classes) == 1 and len(classes) == 1 and len(classes[0]) == 2 and effect in classes[0]
    if found.verdict != "class" or not right:
        return result | {"usable": False}
    steps: dict[str, Step] = classes[0]
    names = sorted(steps, key=lambda name: name != effect)
    effects = {name: list(steps[name].effects) for name in names}
    vectors = {name: steps[name].fit.vector for name in names}
    contest = Contest.from_fits(table, effects, vectors)
    first = _planned(contest, number)
    result |= {
        "rival": names[1],
        "first_rows": len(table),
        "rows_needed": first["needed"],
        "ahead_first": contest.ahead,
    }
    if contest.ahead > COINCIDE or contest.ahead < -COINCIDE:
        return result | {"usable": False, "decided": True}
    if first["needed"] > TELLABLE:
        return result | {"usable": False, "twins": True}
    began, measured = contest, table
    rounds, rows = [], 0
    for turn in range(ROUNDS):
        plan = first if turn == 0 else _planned(contest, number)
        generator = np.random.default_rng([number, 31, turn])
        measured = truth.measured(measured, plan["table"], generator)
        later = contest.after(measured, effects)
        rows += len(plan["table"])
        rounds.append({k: plan[k] for k in ("rows", "expected", "seconds", "efficiency", "mountings")})
        rounds[-1]["realized"] = later.ahead - contest.ahead
        contest = later
        if contest.split:
            break
    result |= {"usable": True, "rounds": rounds, "rows": rows, "split": contest.split, "right": contest.ahead > 0}
    if whole_search:
        again = searched(measured, number)
        result |= {"again": again.verdict, "again_classes": [list(c) for c in again.classes]}
    for order in ("in order", "at random"):
        result[order] = _grid(truth, table, began, effects, order, number)
    return result


def _planned(contest: Contest, seed: int) -> dict:
    """A plan of as many rows as are expected to split the class, and what is expected of it."""
    began = time.perf_counter()
    goal = Discriminate.from_fits([contest.members])
    there = candidates(contest.known, goal, REACH)
    needed = rows_for(there.objective, 4, 4, SPLIT)
    for rows in ROWS:
        chosen = choose(there.objective, rows, None, 0.0, seed)
        table = ordered(there, chosen.visits, contest.known.table, seed)
        scored = score(contest.known, goal, table)
        if scored.weakest.gain >= SPLIT:
            break
    true = next(one for one in scored.gains if one.name[0] == next(iter(contest.members)))
    return {
        "table": table,
        "rows": rows,
        "expected": true.gain,
        "needed": min(needed, 1e9),
        "efficiency": scored.weakest.gain / chosen.ideal.bound,
        "mountings": len(chosen.visits),
        "seconds": time.perf_counter() - began,
    }


def _grid(truth: Truth, table: pd.DataFrame, contest: Contest, effects: dict, order: str, seed: int) -> dict:
    """Rows of a grid over the bed's reach, state by state, until the class is split."""
    grid = reach(contest.known.table, PRESSURES, REACH)
    places = np.arange(len(grid) // PRESSURES)
    generator = np.random.default_rng([seed, 37])
    if order == "at random":
        places = generator.permutation(places)
    for count in _counts(len(places)):
        rows = np.concatenate([np.arange(PRESSURES) + PRESSURES * place for place in places[:count]])
        # The same noise in each look: a longer grid begins with the shorter one's rows.
        noise = np.random.default_rng([seed, 41])
        after = contest.after(truth.measured(table, grid.iloc[rows], noise), effects)
        if after.split:
            return {"rows": int(count * PRESSURES), "split": True, "right": after.ahead > 0}
    return {"rows": int(len(places) * PRESSURES), "split": False, "right": False}


def _counts(most: int) -> Iterator[int]:
    count = 1
    while count < most:
        yield count
        count = max(count + 1, int(count * STRIDE))
    yield most
