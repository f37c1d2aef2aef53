"""The 95 % bands of one row in a trace: miss, with all that is constant made beforehand."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.queries.inverse.miss import Miss
from freelearn.queries.inverse.system import System


@dataclass(frozen=True)
class Banded:
    """own (2, 2): covariance that is the same everywhere, of the readings and of what the model misses. errors (m,):
    one standard deviation of each input. matrix (p, p): of the model's raw vector, None where nothing is known of it.
    unknown (u,) int64: its numbers that nobody knows."""

    own: Tensor
    errors: Tensor
    matrix: Tensor | None
    unknown: Tensor

    @classmethod
    def from_miss(cls, miss: Miss, system: System) -> Banded:
        """As a fitted model's bands have it."""
        own, errors = miss.beyond, torch.zeros(len(system.inputs), dtype=torch.float64)
        if miss.accuracy is not None:
            readings = [getattr(miss.accuracy, q.error) for q in system.bed.readings]
            own = own + torch.diag(torch.tensor(readings, dtype=torch.float64) ** 2)
            errors = torch.tensor([getattr(miss.accuracy, q.error) for q in system.inputs], dtype=torch.float64)
        matrix = None if miss.parameters.silent else miss.parameters.matrix
        return cls(own, errors, matrix, torch.nonzero(miss.parameters.undetermined)[:, 0])

    def deviations(self, system: System, x: Tensor, slopes: Tensor, maps: Tensor | None = None) -> Tensor:
        """One standard deviation of what a new measurement is off by, of each output (1, 2), or of what maps (1, k, 2)
        make of both, (1, k); NaN where nobody knows. slopes: (1, 2, m) at x."""
        spread = slopes * self.errors
        total = self.own + spread @ spread.transpose(1, 2)
        lost = torch.zeros(1, 2, dtype=torch.bool)
        if self.matrix is not None:
            rate = _by_parameters(system, x)
            total = total + rate @ self.matrix @ rate.transpose(1, 2)
            if len(self.unknown):
                lost = (rate[:, :, self.unknown].abs() > 0).any(-1)
        if maps is not None:
            total = maps @ total @ maps.transpose(1, 2)
            lost = ((maps != 0) & lost[:, None, :]).any(-1)
        variance = torch.diagonal(total, dim1=-2, dim2=-1)
        return torch.where(lost, torch.nan, variance.clamp_min(0).sqrt())


def _by_parameters(system: System, x: Tensor) -> Tensor:
    """As System.by_parameters, (1, 2, p), in a trace."""
    vector = system.model.vector().detach()
    copies = (vector + 0.0 * x[:, :1]).detach().requires_grad_()
    with torch.enable_grad():
        states = system.states.with_inputs(x.detach().unbind(-1))
        y = system.model.chain(states, system.model.physical(copies)).loads
        each = [
            torch.autograd.grad(y[:, i].sum(), copies, retain_graph=True, materialize_grads=True)[0] for i in (0, 1)
        ]
    return torch.stack(each, dim=1)
