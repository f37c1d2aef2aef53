"""How much each effect would explain, as numbers and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from freelearn.inference.thresholds import CLEAR
from freelearn.results.formats import error_percent, fixed, number
from freelearn.results.tables import DisplayTable

# What p tells of an effect, however large: how much the rest of the misfit would give to any by chance.
STANDS_OUT, NO_MORE = f"stands out, p ≤ {CLEAR:g}", "may be the rest of the misfit"

# Of a candidate in discovery.json.
COLUMNS = ["effect", "p_value", "E_heldout", "E_new_sample", "score", "step", "status", "reason"]


def ranking_numbers(candidates: Sequence[Mapping[str, Any]], step: int = 0) -> pd.DataFrame:
    """The tested candidates of one step of discovery.json, largest first: effect, size [σ], p_value, E_heldout, and
    what else stands there.

    >>> ranking_numbers([{"effect": "end_clamps", "status": "tested", "step": 0, "score": 4.0, "p_value": 0.01,
    ...                   "E_heldout": None}])["size"].tolist()
    [2.0]
    """
    rows = [c for c in candidates if c["status"] == "tested" and c["step"] == step]
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"score": float, "p_value": float, "E_heldout": float})
    table.insert(1, "size", np.sqrt(table["score"].clip(lower=0)))
    return table.sort_values("size", ascending=False).reset_index(drop=True)


def ranking_table(numbers: pd.DataFrame, most: int | None = None) -> DisplayTable:
    """numbers: of ranking_numbers. most: effects shown, None for all."""
    columns = [numbers[name].tolist() for name in ("effect", "size", "p_value", "E_heldout")]
    rows = [
        [effect, fixed(size, 1), number(p_value, 3), error_percent(error, 3)]
        for effect, size, p_value, error in list(zip(*columns, strict=True))[:most]
    ]
    return DisplayTable.of(
        ["effect"],
        ["effect size", "p by chance", "E held-out %"],
        rows,
        title="Which effects would explain it, before any was added",
    )


def untested_lines(candidates: Sequence[Mapping[str, Any]]) -> list[str]:
    """Effects that were not tested at first, and why."""
    return [
        f"{c['effect']}: {c['reason']}" for c in candidates if c["status"] != "tested" and c.get("step") in (0, None)
    ]
