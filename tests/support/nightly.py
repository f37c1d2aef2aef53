"""What runs in the usual tests, and what only where FREELEARN_TESTS=all asks for everything (`make nightly`).

Whole tests are marked `nightly`; here is what makes the others smaller."""

from __future__ import annotations

import os
import random
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import pytest

Case = TypeVar("Case")

EVERY = os.environ.get("FREELEARN_TESTS") == "all"


def chosen(cases: Sequence[Case], n: int, seed: int = 0) -> list[Case]:
    """All cases where every one is wanted; else n of them, in their own order, drawn by the seed."""
    if EVERY or n >= len(cases):
        return list(cases)
    kept = sorted(random.Random(seed).sample(range(len(cases)), n))
    return [cases[k] for k in kept]


def usually(*cases: Any, nightly: Iterable[Any] = ()) -> list[Any]:
    """Cases of a parametrized test: the ones that tell most for their time, and those that run every night."""
    return [*cases, *(pytest.param(case, marks=pytest.mark.nightly) for case in nightly)]
