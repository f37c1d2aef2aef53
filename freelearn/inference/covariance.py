"""Uncertainty of a step's parameters."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.inference.linear_algebra import normal_inverse
from freelearn.inference.step import Step


def parameter_covariance(step: Step) -> Tensor:
    """Covariance of the declared physical parameters (SI), scaled by the noise that was measured: (k, k).

    Of heavy tails the weighted Jacobian promises more than they hold: divided by the errors' efficiency."""
    fit = step.fit
    if not fit.model.declared:
        return torch.zeros(0, 0)
    inverse = normal_inverse(fit.jacobian.flatten(0, 1), smallest=1e-13)

    def declared(vector: Tensor) -> Tensor:
        values = fit.model.physical(vector)
        return torch.stack([values[name] for name in fit.model.declared])

    change = torch.func.jacfwd(declared)(fit.vector)
    covariance: Tensor = change @ inverse @ change.T * step.left.scale**2 / step.whiten.efficiency
    return covariance
