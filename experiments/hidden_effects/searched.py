"""A table that is looked at and searched as discover.py does, and what of its answer is there, or is not."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import pandas as pd
import torch

import freelearn as fl
from freelearn.discovery.referee.referee import CLAIMS
from freelearn.physics.effects.registry import EFFECTS


def searched(
    job: Mapping[str, Any], table: pd.DataFrame, accuracy: Mapping[str, float], members: pd.DataFrame | None = None
) -> dict[str, Any]:
    """The job with what came out; all JSON."""
    torch.set_num_threads(1)
    began = time.perf_counter()
    found = fl.discover(table, members=members, accuracy=fl.Accuracy(**accuracy), progress=False)
    return {**job} | {
        "verdict": found.verdict, "classes": found.content["classes"], "rows": len(table),
        "says": found.content["says"], "formulas": [proposal["formula"] for proposal in found.content["proposals"]],
        "seconds": time.perf_counter() - began,
    }  # fmt: skip


def judged(results: list[dict[str, Any]]) -> pd.DataFrame:
    """claims: whether anything is claimed; there: whether a class holds what is hidden; more, of_library: whether
    another one, or one with effects of the library, holds nothing of it."""
    frame = pd.DataFrame(results)
    both = [(set(hidden), classes) for hidden, classes in zip(frame["hidden"], frame["classes"], strict=True)]
    others = [[set(some) for some in classes if not hidden & set(some)] for hidden, classes in both]
    return frame.assign(
        claims=frame["classes"].map(bool) & frame["verdict"].isin(CLAIMS),
        there=[any(hidden & set(some) for some in classes) for hidden, classes in both],
        more=[bool(other) for other in others],
        of_library=[any(some & set(EFFECTS) for some in other) for other in others],
    )
