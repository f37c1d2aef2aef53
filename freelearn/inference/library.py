"""Which effects can be tested on a model and a table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from freelearn.models.base import Model
from freelearn.models.effects.registry import EFFECTS


def candidates(model: Model, given: Iterable[str], columns: Iterable[str]) -> tuple[list[str], list[dict[str, Any]]]:
    """Names of the effects to test, and an entry of discovery.json for each that cannot be, with the reason."""
    present, family = set(columns), getattr(model, "family", model.name)
    names, out = [], []
    for name, effect in EFFECTS.items():
        if name in set(given):
            continue
        missing = [c for c in getattr(effect, "needs", ()) if c not in present]
        if missing:
            out.append(_out(name, f"needs the column {', '.join(missing)}"))
        elif family not in effect.families():
            out.append(_out(name, f"works with {', '.join(effect.families())} only"))
        else:
            names.append(name)
    return names, out


def _out(name: str, reason: str) -> dict[str, Any]:
    entry = {"step": 0, "effect": name, "status": "not_testable", "reason": reason}
    return entry | {"score": None, "p_value": None, "E_heldout": None, "E_new_sample": None}
