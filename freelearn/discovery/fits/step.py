"""One model on the way of a search, what was tried from it, and how uncertain its parameters are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypedDict

import numpy as np
import torch
from scipy.special import stdtrit
from torch import Tensor

from freelearn.data.states import States
from freelearn.discovery.fits.left_out import HeldOut, mean_of
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.noise.structure import Structure, structure
from freelearn.discovery.thresholds import RISEN, RISES


class Candidate(TypedDict):
    """An effect at one step of a search.

    step: place of the step in the trail. status: tested, not_testable or failed, the latter two with a reason. score:
    reduction of χ² that it promised; p_value: chance that the most promising of all would promise as much with nothing
    to find. E_heldout, E_new_sample: errors with the effect, as of a step; None where it was not fitted."""

    step: int
    effect: str
    status: str
    reason: str
    score: float | None
    p_value: float | None
    E_heldout: float | None
    E_new_sample: float | None


def not_testable(effect: str, reason: str) -> Candidate:
    """The entry of an effect that the table or the rows cannot show."""
    return Candidate(
        step=0,
        effect=effect,
        status="not_testable",
        reason=reason,
        score=None,
        p_value=None,
        E_heldout=None,
        E_new_sample=None,
    )


# One model on the way of a search.


@dataclass(frozen=True)
class Step:
    """One model on the way: its fit, held-out residuals, what is left, and the candidates that were tried on it.

    effects: all that the model has, the given ones first. E_train, E_heldout: the paper's error on the fitted rows and
    on held-out kinematic states; E_new_sample: on whole samples left out in turn (None with one sample, or where a
    parameter belongs to a sample); floor: what measuring alone leaves of it (fractions). by_state: what each state adds
    to the square of E_heldout, (states,)."""

    effects: list[str]
    fit: WhiteFit
    whiten: Whitener
    heldout: HeldOut
    states: States
    E_train: float
    E_heldout: float
    E_new_sample: float | None
    floor: float
    by_state: np.ndarray
    candidates: Sequence[Candidate] = ()

    @cached_property
    def left(self) -> Structure:
        """What is systematic in the residuals that are left."""
        return structure(self.fit.residual, self.fit.jacobian, self.states, self.whiten)

    def worse(self, other: Step) -> bool:
        """Whether its held-out error is clearly larger than another's: by a share, and by more than the states, few as
        they are, differ in how much larger it is. Errors of places weigh most in it, and hide what is less."""
        (rise, error), count = mean_of(self.by_state - other.by_state), len(self.by_state)
        least = error * stdtrit(count - 1, RISEN) if count > 1 else 0.0
        return bool(self.E_heldout > (1 + RISES) * other.E_heldout and rise > least)

    def tried(self, candidates: Sequence[Candidate]) -> Step:
        """The same step with what was tried on it."""
        step = replace(self, candidates=candidates)
        if "left" in vars(self):  # known already, and dear
            vars(step)["left"] = self.left
        return step


def parameter_covariance(step: Step, wider: float = 1.0) -> Tensor:
    """Covariance of the declared physical parameters (SI), by the readings and by what was known beforehand: (k, k).

    Scaled by the noise that was measured, or by so many times as much of it."""
    fit = step.fit
    if not fit.model.declared:
        return torch.zeros(0, 0)

    def declared(vector: Tensor) -> Tensor:
        values = fit.model.physical(vector)
        return torch.stack([values[name] for name in fit.model.declared])

    change = torch.func.jacfwd(declared)(fit.vector)
    covariance: Tensor = change @ _raw_covariance(step, wider=wider) @ change.T
    return covariance


def heldout_stderr(step: Step) -> Tensor:
    """What the parameters' uncertainty makes of each held-out residual, as a fit to the other folds knows them: one
    standard error (N, 2) SI. It is larger where the others have to be extrapolated."""
    by, fold = step.fit.raw_jacobian, torch.as_tensor(step.heldout.fold)
    variance = torch.zeros_like(step.fit.residual)
    for number in fold.unique():
        own = fold == number
        variance[own] = torch.einsum("ncp,pq,ncq->nc", by[own], _raw_covariance(step, ~own), by[own])
    return variance.clamp_min(0).sqrt()


def _raw_covariance(step: Step, rows: Tensor | None = None, wider: float = 1.0) -> Tensor:
    """Of the raw vector by all or some of the rows, (N,) bool: (p, p).

    Of heavy tails the weighted Jacobian promises more than they hold: multiplied by the errors' efficiency."""
    return step.fit.covariance(rows, step.whiten.efficiency / (wider * step.left.scale) ** 2)
