"""What is left when nothing in the library helps: which inputs it depends on, and a hint at its form."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.discovery.noise.linear_algebra import clear, orthonormal
from freelearn.discovery.noise.noise import Whitener, whitened_basis
from freelearn.discovery.noise.shapes import bases, dense, imposed, monomials

DIRECTION = "direction of the pressure change"
# In the place of a hint where no single term explains anything.
NO_HINT = "none"


@dataclass(frozen=True)
class ResidualSummary:
    """share: of the squared whitened residual that is systematic. inputs: share of that which functions of one input
    alone explain. hint: the one term that explains most of it, and how much; a hint, not a finding."""

    share: float
    inputs: dict[str, float]
    hint: str
    hint_share: float


def summarize_residuals(
    residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener, scale: float
) -> ResidualSummary:
    """Describes whitened residuals (N, 2), predicted − measured, of a fit with whitened Jacobian (N, 2, p).

    scale: standard deviation of the noise that was measured, in units of the stated one (see `Structure`). k columns
    explain k scale² of noise on average, which is not systematic and is taken off.
    """
    flat = residual.reshape(-1)
    absorbed = orthonormal(jacobian.flatten(0, 1))

    def explained(columns: Tensor) -> float:
        span = orthonormal(clear(columns, absorbed))
        return float((span.T @ flat).square().sum()) - span.shape[1] * scale**2

    inputs_named = (*imposed(states), DIRECTION)
    everything = explained(whitened_basis(dense(bases(states)[-1], len(states)), whiten))
    if everything <= 0:
        return ResidualSummary(0.0, dict.fromkeys(inputs_named, 0.0), NO_HINT, 0.0)
    terms, names = monomials(states, 3)
    terms = torch.cat([terms, states.direction[:, None]], dim=1)
    names = [*names, DIRECTION]
    zero = torch.zeros(len(states), dtype=torch.float64)
    best, share = NO_HINT, 0.0
    for column, name in zip(terms.T, names, strict=True):
        for i, quantity in enumerate(states.bed.readings):
            pair = torch.stack([zero, column] if i else [column, zero], dim=1)[..., None]
            part = explained(whiten(pair).flatten(0, 1)) / everything
            if part > share:
                best, share = f"{quantity.name} ~ {name}", part
    inputs = {}
    for name in inputs_named:
        own = [i for i, n in enumerate(names) if n == name or (n.startswith(f"{name}^") and "×" not in n)]
        inputs[name] = max(explained(whitened_basis(terms[:, own], whiten)) / everything, 0.0)
    return ResidualSummary(everything / float(flat.square().sum()), inputs, best, share)
