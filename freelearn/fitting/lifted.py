"""A second start, for searches that may have got stuck where a parameter had gone to nothing."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.models.base import Model

# Positive parameters are lifted by this share of themselves, those that are smaller to this share of their start.
SHARE = 1e-3


def lifted(model: Model[Any], vector: Tensor) -> Tensor:
    """A raw vector (p,) with every positive parameter a little larger, and at least a thousandth of its start.

    A logarithm that went to −∞, or a stiffness matrix at the edge of positive definiteness, has derivatives of next to
    nothing: a search that goes on from there cannot feel what it would gain by coming back.
    """
    with torch.no_grad():
        physical = model.physical(vector)
    values = {name: float(physical[name]) for name in model.declared}
    for name, spec in model.declared.items():
        if not spec.fixed and (spec.log or spec.lower == 0):
            least = SHARE * abs(spec.start)
            values[name] = min(max(values[name] * (1 + SHARE), least), spec.upper)
    if not all(map(math.isfinite, values.values())):
        return vector
    try:
        raw = model.to_raw(values)
    except UserError:
        return vector
    moved = vector.clone()
    moved[len(vector) - len(raw) :] = torch.stack(list(raw.values()))
    return moved
