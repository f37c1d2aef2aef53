"""How many of the attacks run: a seeded sample in the usual tests, every one with FREELEARN_ATTACKS=all."""

from __future__ import annotations

import os
import random
from collections.abc import Sequence
from typing import TypeVar

Case = TypeVar("Case")

EVERY = os.environ.get("FREELEARN_ATTACKS") == "all"


def chosen(cases: Sequence[Case], n: int, seed: int = 0) -> list[Case]:
    """All cases where every attack is wanted; else n of them, in their own order, drawn by the seed."""
    if EVERY or n >= len(cases):
        return list(cases)
    kept = sorted(random.Random(seed).sample(range(len(cases)), n))
    return [cases[k] for k in kept]
