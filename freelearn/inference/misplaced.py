"""Kinematic states whose place slipped, perhaps: all rows of a state agree if it was somewhere else."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from freelearn.inference.linear_algebra import orthonormal
from freelearn.inference.noise import sensitivities
from freelearn.inference.step import Step
from freelearn.inference.suspects import Suspect
from freelearn.measurements.bed_accuracy import shared
from freelearn.measurements.beds import ELONGATION
from freelearn.measurements.rows import Rows

# A place is pointed out if moving it gains so many χ² for each row that tells it, beyond this floor,
EACH, LEAST = 1.0, 60.0
# if it takes away this share of its state's misfit, and if it moves by so many standard deviations of a place.
TAKES, FAR = 0.6, 4.0
# More states than this share (one of few) are no slips: the model errs there.
MOST = 0.05


def misplaced(step: Step, rows: Rows, kept: np.ndarray) -> list[Suspect]:
    """The states (of what a bed imposes on one) that seem to have been elsewhere, the clearest first.

    For either quantity of each state the whitened residuals are regressed on how its rows answer to it, cleared of what
    the model's parameters absorb. kept: which of the rows that were asked about the step's rows (N) are.
    """
    scatter, whiten, bed = step.whiten.scatter, step.whiten, rows.states.bed
    if scatter is None:
        return []
    answers = sensitivities(step.fit.model, rows.states)[:, :, :2] * rows.readings.felt(step.fit.shown)[..., None]
    columns, span = whiten(answers), orthonormal(step.fit.jacobian.flatten(0, 1)).reshape(len(rows), 2, -1)
    flat = span.flatten(0, 1)
    rest = step.fit.residual - (span @ (flat.T @ step.fit.residual.reshape(-1)))
    along = _sum(columns * rest[..., None], whiten.state, whiten.states)
    absorbed = torch.stack([_sum(span * columns[:, :, k, None], whiten.state, whiten.states) for k in (0, 1)], dim=1)
    size = _sum(columns.square(), whiten.state, whiten.states) - absorbed.square().sum(-1)
    move = -along / size.clamp_min(1e-300)
    gain = torch.where(size > 0, along.square() / size.clamp_min(1e-300), 0.0)
    misfit = _sum(rest.square()[..., None], whiten.state, whiten.states)
    told = _sum((columns.abs().sum(-1) > 0).double()[..., None], whiten.state, whiten.states)
    typical = shared(scatter.like, bed) * scatter.position * scatter.tails.deviation
    stated = torch.minimum(shared(scatter.like, bed), typical)
    clear = (gain > LEAST + EACH * told) & (gain > TAKES * misfit) & (move.abs() > FAR * stated)
    chosen = torch.nonzero(clear & (gain == gain.amax(1, keepdim=True)))
    if len(chosen) > max(1, int(MOST * whiten.states)):
        return []
    place = np.flatnonzero(kept)
    out = []
    for state, which in chosen.tolist():
        own = torch.nonzero(whiten.state == state)[:, 0]
        shown = float(rows.states.inputs()[which][own[0]])
        if bed.state[which] is ELONGATION:
            shown -= float(rows.states.reference_length[own[0]])
        where = tuple(int(p) for p in place[own.numpy()])
        sigmas = -float(torch.sign(move[state, which]) * gain[state, which].sqrt())
        expected = shown + float(move[state, which])
        slip = f"the place of this state: all of its {len(own)} rows agree if it was there"
        out.append(Suspect(where[0], bed.state[which].name, shown, expected, sigmas, slip, where))
    return sorted(out, key=lambda s: -abs(s.sigmas))


def _sum(each: Tensor, state: Tensor, states: int) -> Tensor:
    """Sum over the readings of each state: (N, 2, k) → (states, k)."""
    return torch.zeros(states, each.shape[-1], dtype=each.dtype).index_add_(0, state, each.sum(1))
