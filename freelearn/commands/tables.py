"""The measurement table that a `data` configuration names."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.bed.hidden import hidden_effects
from freelearn.bed.virtual import simulate
from freelearn.errors import UserError

# Tables kept in memory, so that the jobs of a sweep in one process read or simulate each of them once.
KEPT = 4


def load_table(data: dict[str, Any]) -> tuple[pd.DataFrame, list[str], dict[str, Any]]:
    """The table of a `data` configuration, warnings about it, and where it came from. Raises UserError.

    The table is shared between callers: none may change it in place.
    """
    if data["name"] == "virtual":
        parts = {k: data[k] for k in ("truth", "accuracy", "buckled_share", "seed")}
        if not isinstance(data["accuracy"], dict):
            raise UserError("data.accuracy=estimate is for measured data: the simulated bed needs to know its noise.")
        parts["effects"] = data["truth_effects"] or {}
        if data["hidden"] is not None:
            parts["effects"] = hidden_effects(data["hidden"], data["seed"])
        provenance = {"name": "virtual", "simulated": True, "seed": data["seed"]}
        return _simulated(json.dumps(parts)), [], provenance
    if data["path"] in (None, "???"):
        raise UserError("data=csv needs the table's file: add data.path=FILE.")
    digest = data_version(data)
    table, warnings = _read(str(data["path"]), digest)
    return table, list(warnings), {"name": "csv", "simulated": False, "path": str(data["path"]), "sha256": digest}


def data_version(data: dict[str, Any]) -> str:
    """SHA-256 of the table's file; empty for simulated data, which their settings determine, and unreadable files."""
    if data["name"] == "virtual":
        return ""
    try:
        return hashlib.sha256(Path(data["path"]).read_bytes()).hexdigest()
    except OSError:
        return ""  # reading the table says what is wrong with the file


@lru_cache(KEPT)
def _simulated(settings: str) -> pd.DataFrame:
    data = json.loads(settings)
    return simulate(data["truth"], data["effects"], data["accuracy"], data["buckled_share"], data["seed"])


@lru_cache(KEPT)
def _read(path: str, digest: str) -> tuple[pd.DataFrame, tuple[str, ...]]:
    # pandera takes a second to import: only for measured tables.
    from freelearn.measurements.table import read_table

    table, warnings = read_table(path)
    return table, tuple(warnings)
