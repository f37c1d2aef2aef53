"""The function that enters at a proposal's place, without a form: what the data say it is, with a band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.interpolate import BSpline
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.discovery.fits.derivatives import Build
from freelearn.discovery.fits.step import parameter_covariance
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.proposals.proposal import Proposal
from freelearn.discovery.proposals.pushes import pushes
from freelearn.physics.written.places import Input
from freelearn.physics.written.written_effect import scaled

# Knots of the cubic spline over the input, its penalty's strengths to choose from, and points of the curve.
KNOTS, STRENGTHS, POINTS = 10, np.logspace(-4, 8, 49), 121
# Share of a function's squared pushes that is rounding.
ABSORBED = 1e-18
# Half of the points' 95 % band, in standard deviations.
BAND = 1.96


@dataclass(frozen=True)
class Unknown:
    """A curve over one input, (POINTS,) each in SI: at, the closed form, and the free function with its 95 % band."""

    over: Input
    at: np.ndarray
    form: np.ndarray
    free: np.ndarray
    low: np.ndarray
    high: np.ndarray


def unknown(proposal: Proposal, rows: Rows, build: Build) -> Unknown | None:
    """Of a proposal with one input that a push tells: its form, and that plus a penalized cubic spline (Eilers & Marx
    1996) of what the residuals still ask for, the penalty by its evidence. None for energies, potentials and pairs."""
    written = proposal.written
    if len(written.inputs) != 1 or written.place.energy or written.place.potential:
        return None
    step, (of,) = proposal.step, written.inputs
    seen = pushes(step.fit, rows, build)
    if seen.by[written.place.name].shape[2] != 1:
        return None
    x = seen.inputs[of.name][:, 0]
    basis, ends = _basis(x, float(x.min()), float(x.max()))
    columns = step.whiten(seen.by[written.place.name] * basis[:, None, :]).flatten(0, 1)
    span = orthonormal(_others(proposal))
    whole = float(columns.square().sum())
    columns = columns - span @ (span.T @ columns)
    # Where the other parameters absorb all of it, no function can be told from them.
    if not float(columns.square().sum()) > ABSORBED * whole:
        return None
    free, covariance = _penalized(columns, -step.fit.residual.reshape(-1), step.left.scale**2)
    at = torch.linspace(*ends, POINTS, dtype=torch.float64)
    shown, _ = _basis(at, *ends)
    form, form_variance = _form(proposal, at)
    # The form's own constants are no better known than the fit says, however little is asked for beside it.
    variance = torch.einsum("nk,kj,nj->n", shown, covariance, shown).clamp_min(0) + form_variance
    mean, error = form + shown @ free, variance.sqrt()
    return Unknown(of, *(v.numpy() for v in (at, form, mean, mean - BAND * error, mean + BAND * error)))


def _others(proposal: Proposal) -> Tensor:
    """What the other parameters of the model absorb, (2N, p): a function cannot be told from them."""
    step, name = proposal.step, proposal.written.name
    others = [i for i, label in enumerate(step.fit.model.labels()) if not label.startswith(f"{name}.")]
    return step.fit.jacobian.flatten(0, 1)[:, others]


def _form(proposal: Proposal, at: Tensor) -> tuple[Tensor, Tensor]:
    """The closed form at values of the input (n,), and its variance by its constants', (n,) each in SI."""
    written, step = proposal.written, proposal.step
    constants = written.constants()

    def value(known: Tensor) -> Tensor:
        named = dict(zip((c.name for c in constants), known, strict=True))
        shapes = {s.name: named[s.name] / scaled(s, written.scales[0]) for s in written.form.shapes}
        terms = written.form.values([at / written.scales[0]], shapes)
        amounts = [named[c.name] for c in constants if c.amount]
        return torch.stack([a * t for a, t in zip(amounts, terms, strict=True)]).sum(0)

    known = torch.tensor([c.start for c in constants], dtype=torch.float64)
    declared = list(step.fit.model.declared)
    own = [declared.index(f"{written.name}.{c.name}") for c in constants]
    slopes = torch.func.jacfwd(value)(known)
    covariance = parameter_covariance(step)[own][:, own]
    return value(known), torch.einsum("nk,kj,nj->n", slopes, covariance, slopes).clamp_min(0)


def _basis(x: Tensor, low: float, high: float) -> tuple[Tensor, tuple[float, float]]:
    """Cubic B-splines at x (n,): (n, KNOTS + 2)."""
    step = (high - low) / (KNOTS - 1)
    knots = low + step * np.arange(-3, KNOTS + 3)
    return torch.as_tensor(BSpline.design_matrix(x.numpy(), knots, 3, extrapolate=True).toarray()), (low, high)


def _penalized(columns: Tensor, residual: Tensor, variance: float) -> tuple[Tensor, Tensor]:
    """Coefficients (k,) that explain residuals, and their covariance (k, k); second differences are penalized."""
    count = columns.shape[1]
    rough = np.diff(np.eye(count), 2, axis=0)
    gram, slope = (columns.T @ columns).numpy() / variance, (columns.T @ residual).numpy() / variance
    size = float(np.trace(gram)) / count
    # A little of the coefficients themselves: what other parameters absorb is not told.
    penalty = rough.T @ rough + 1e-6 * np.eye(count)
    best: tuple[float, Sequence[np.ndarray]] | None = None
    for strength in STRENGTHS:
        prior = strength * size * penalty
        whole = gram + prior
        coefficients = np.linalg.solve(whole, slope)
        evidence = 0.5 * float(slope @ coefficients) + 0.5 * (np.linalg.slogdet(prior)[1] - np.linalg.slogdet(whole)[1])
        if best is None or evidence > best[0]:
            best = evidence, (coefficients, np.linalg.inv(whole))
    assert best is not None
    return torch.as_tensor(best[1][0]), torch.as_tensor(best[1][1])
