"""What is hidden in which data set, and how it is measured."""

from __future__ import annotations

from collections.abc import Sequence
from zlib import crc32

import numpy as np
from beyond_library import kinds_open, kinds_sealed
from beyond_library.kind import Kind
from hidden_effects.plan import settings

from freelearn.testing.reference.truths import BRAIDED, MOVED, UNIT

HALVES: dict[str, tuple[Kind, ...]] = {"open": kinds_open.KINDS, "sealed": kinds_sealed.KINDS}
LIBRARY = (*UNIT, *BRAIDED, *MOVED)
SIZES = (8, 15, 30)
# Control sets of each round: with nothing hidden, and with one effect of the library.
FREE, NAMED = 20, 30
# Rounds of the full plan: 200 control sets.
ROUNDS = 4


def kinds_of(job: dict) -> list[Kind]:
    """The kinds that a data set hides."""
    names = {job["kind"], job.get("beside")}
    return [kind for kind in HALVES[job["half"]] if kind.name in names]


def plan(half: str, rounds: int, sizes: Sequence[int]) -> list[dict]:
    """Every data set: half, kind or effect that it hides (None: none), size in σ, round, and how it is measured.

    Each is made from its own key alone, whatever else is in the plan."""
    jobs = []
    for number in range(rounds):
        hidden: list[tuple[str | None, str | None, int]] = []
        hidden += [(kind.name, None, size) for kind in HALVES[half] for size in sizes]
        hidden += [(None, None, 0)] * FREE
        for k in range(NAMED):
            size = sizes[(number + k) % len(sizes)]
            hidden.append((None, LIBRARY[(NAMED * number + k) % len(LIBRARY)], size))
        counts: dict[str, int] = {}
        for kind, effect, size in hidden:
            name = f"{half}/{kind or effect or 'nothing'}/{size}/{number}"
            counts[name] = counts.get(name, 0) + 1
            key = f"{name}/{counts[name]}"
            jobs.append({"key": key, "half": half, "kind": kind, "effect": effect, "size": size, **_measured(key)})
    return jobs


def pairs(half: str, rounds: int, sizes: Sequence[int]) -> list[dict]:
    """Every kind of a half once a round and size beside another one, at another place, and once beside an effect of the
    library; energies beside other kinds alone."""
    jobs = []
    for number in range(rounds):
        generator = np.random.default_rng([number, 2040])
        for size in sizes:
            for kind in HALVES[half]:
                others = [o for o in HALVES[half] if (o.port, o.where) != (kind.port, kind.where)]
                other, effect = str(generator.choice([o.name for o in others])), str(generator.choice(list(UNIT)))
                hidden = [{"beside": other, "effect": None}]
                hidden += [{"beside": None, "effect": effect}] if kind.port != "energy" else []
                for second in hidden:
                    key = f"{half}/{kind.name}+{second['beside'] or second['effect']}/{size}/{number}"
                    jobs.append({"key": key, "half": half, "kind": kind.name, "size": size} | second | _measured(key))
    return jobs


def _measured(key: str) -> dict:
    """Seed, how many actuators, and the settings of the laboratory."""
    seed = crc32(key.encode())
    generator = np.random.default_rng(seed)
    how = settings("standard", generator)
    # Functions of the pressure cannot be told from five levels of it.
    how |= {"states": 60, "pressures": int(generator.integers(6, 9)), "falling": int(generator.integers(2, 5))}
    return {"seed": seed, "actuators": int(generator.integers(1, 4)), "laboratory": how}
