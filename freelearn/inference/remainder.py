"""What is left when nothing in the library helps: which inputs it depends on, and a hint at its form."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.inference.noise import Whitener
from freelearn.inference.structure import bases, clear, monomials, orthonormal, whitened_basis
from freelearn.measurements.states import States


@dataclass(frozen=True)
class Remainder:
    """share: of the squared whitened residual that is systematic. inputs: share of that which functions of one input
    alone explain. hint: the one term that explains most of it, and how much; a hint, not a finding."""

    share: float
    inputs: dict[str, float]
    hint: str
    hint_share: float


def remainder(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> Remainder:
    """Describes whitened residuals (N, 2), predicted − measured, of a fit with whitened Jacobian (N, 2, p)."""
    flat = residual.reshape(-1)
    absorbed = orthonormal(jacobian.flatten(0, 1))

    def explained(columns: Tensor) -> float:
        span = orthonormal(clear(columns, absorbed))
        return float((span.T @ flat).square().sum()) - span.shape[1]

    everything = max(explained(whitened_basis(bases(states)[-1], whiten)), 1e-300)
    terms, names = monomials(states, 3)
    terms = torch.cat([terms, states.direction[:, None]], dim=1)
    names = [*names, "direction of the pressure change"]
    zero = torch.zeros(len(states), dtype=torch.float64)
    best, share = "none", 0.0
    for column, name in zip(terms.T, names, strict=True):
        for load in ("force", "moment"):
            pair = torch.stack([column, zero] if load == "force" else [zero, column], dim=1)[..., None]
            part = explained(whiten(pair).flatten(0, 1)) / everything
            if part > share:
                best, share = f"{load} ~ {name}", part
    inputs = {}
    for name in ("elongation", "twist", "pressure", "direction of the pressure change"):
        own = [i for i, n in enumerate(names) if n == name or (n.startswith(f"{name}^") and "×" not in n)]
        inputs[name] = explained(whitened_basis(terms[:, own], whiten)) / everything
    return Remainder(everything / float(flat.square().sum()), inputs, best, share)
