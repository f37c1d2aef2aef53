"""How a user's own priors pull at the parameters of a least-squares fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.fitting.problem import Problem
from freelearn.models.base import Model
from freelearn.models.priors import RawPrior, raw_prior, spans


@dataclass(frozen=True)
class Pull:
    """‖root (x − middle)‖² joins the sum of squares of a raw vector x. root (k, p); middle (p,). spread: of a
    kinematic state's residual, in units of the sum of squares, by which the priors were weighed."""

    root: Tensor
    middle: Tensor
    spread: float

    @classmethod
    def of(cls, problem: Problem, vector: Tensor) -> Pull | None:
        """Of the priors that were given for the problem's model, weighed at a raw vector (p,); None without any.

        A residual is worth what all are at the vector, each kinematic state counting once, because all its rows may
        share one error: many rows of a model that is wrong do not outweigh what is known. Priors that are declared take
        no part: this is the fit of the paper.
        """
        model = problem.model
        given = torch.tensor([model.known.prior(label) is not None for label in model.labels()]) & model.free
        if not bool(given.any()):
            return None
        prior = raw_prior(model, spans(problem.rows))
        everything = torch.diag(torch.full_like(prior.middle, torch.inf))
        both = given[:, None] & given
        root = RawPrior(prior.middle, torch.where(both, prior.covariance, everything)).root
        with torch.no_grad():
            total = float(problem.residuals(vector[None])[0].square().sum())
        states = len(np.unique(problem.rows.state))
        spread = (total / max(states - int(model.free.sum()), 1)) ** 0.5
        return cls(spread * root[given], torch.where(given, prior.middle, 0.0), spread)

    def residuals(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, k)."""
        return (vectors - self.middle) @ self.root.T


def pulled(model: Model) -> bool:
    """Whether a fit of the model has priors to heed."""
    return any(model.known.prior(label) is not None and not p.fixed for label, p in model.declared.items())
