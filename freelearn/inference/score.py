"""How strongly the residuals of a fit ask for each effect, before any of them is fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import torch
from scipy.optimize import lsq_linear
from torch import Tensor

from freelearn.fit.problem import Problem
from freelearn.inference.noise import Whitener
from freelearn.inference.structure import norms, orthonormal
from freelearn.inference.white_fit import ONE, WhiteFit
from freelearn.measurements.rows import Rows
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.effects.registry import EFFECTS

# Sign patterns of the wild bootstrap.
DRAWS = 999
# Values tried for a parameter that is undefined without the effect (a time constant, say), as factors of its start.
GRID = (0.1, 0.3, 1.0, 3.0, 10.0)
# An effect of which refitting the base parameters leaves less than this share cannot be seen in these data.
ABSORBED = 1e-4

# A model with the fit's effects and some more: names → Model.
Build = Callable[[Sequence[str]], Model]
# A model, the factors of its gridded parameters by label, and the derivatives there by label.
Variants = list[tuple[Model, dict[str, float], dict[str, Tensor]]]


@dataclass
class EffectScore:
    """gain: reduction of χ² that the linearised effect promises. p_value: chance that the most promising of all
    effects would promise as much if there were nothing to find. size: σ of the effect after refitting, √gain.
    start: raw parameters (p,) of the model with the effect, from which a full fit sets out."""

    effect: str
    status: str = "tested"
    reason: str = ""
    gain: float = 0.0
    p_value: float = 1.0
    start: Tensor | None = None
    signature: Tensor | None = None
    _evidence: float = field(default=-math.inf, repr=False)
    _null: np.ndarray | None = field(default=None, repr=False)


def score_effects(
    fit: WhiteFit, rows: Rows, whiten: Whitener, names: Sequence[str], build: Build, variance: float, seed: int
) -> list[EffectScore]:
    """Scores every named effect at the fit. variance: of the whitened noise, from `structure`.

    Rao's score test: with C the effect's whitened derivative at no effect, cleared of what the fit's own parameters can
    absorb, the promised reduction is that of regressing the residuals on C, under the bounds that hold at no effect.
    Significance is that of the largest over the whole library, by a wild bootstrap that flips the signs of whole
    kinematic states (Cameron, Gelbach & Miller 2008), so it holds with noise shared by a state's rows and with misfit.
    """
    absorbed = orthonormal(fit.jacobian.flatten(0, 1))
    generator = np.random.default_rng([seed, 7])
    signs = torch.as_tensor(generator.choice([-1.0, 1.0], size=(DRAWS, whiten.states)))
    scores = []
    plain = [n for n in names if not _gridded(build([n]), n, fit)]
    held = _hold(fit, rows)
    shared: dict[str, Tensor] = {}
    for group in _groups(plain):
        shared |= _columns(build(group), fit, rows, whiten, held)
    for name in names:
        alone: Variants = [(build([name]), {}, shared)]
        variants = alone if name in plain else _grid(name, build, fit, rows, whiten, held)
        best = EffectScore(name, status="failed", reason="its derivative at no effect is not finite")
        for model, fixed, columns in variants:
            found = _one(name, model, fixed, columns, fit, absorbed, whiten, signs, variance)
            if found._null is not None and best._null is not None:
                # Several grid values of one effect: chance has as many tries.
                found._null = best._null = np.maximum(found._null, best._null)
            if best.status != "tested" or found._evidence > best._evidence:
                best = found if found.status == "tested" or best.status != "tested" else best
        scores.append(best)
    tested = [s for s in scores if s._null is not None]
    if tested:
        largest = np.max([s._null for s in tested if s._null is not None], axis=0)
        for s in tested:
            s.p_value = float((1 + (largest >= s._evidence).sum()) / (DRAWS + 1))
    return scores


def _groups(names: Sequence[str]) -> list[list[str]]:
    """Effects whose derivatives are taken in one model each: series springs solve the whole chain several times over,
    so they are kept away from the energies, which are dear; what acts on the loads needs no structure at all."""
    energies = [n for n in names if EFFECTS[n].port == "energy"]
    springs = [n for n in names if EFFECTS[n].yields]
    late = [n for n in names if EFFECTS[n].late]
    rest = [n for n in names if n not in (*energies, *springs, *late)]
    return [group for group in (energies, springs, late, rest) if group]


class _Held(NamedTuple):
    """What the fit's ideal actuators carry (N, 2), and the states imposed on them, cut from every derivative."""

    states: States
    loads: Tensor


def _hold(fit: WhiteFit, rows: Rows) -> _Held | None:
    """None where a mount that gives way makes the state depend on the loads."""
    if fit.model.yielding:
        return None
    with torch.no_grad():
        values = fit.model.physical(fit.vector)
        states = fit.model.imposed(rows.states, values)
        return _Held(states, fit.model.ideal(states, values).loads)


def _labels(model: Model, name: str) -> list[str]:
    return [label for label in model.declared if label.startswith(f"{name}.")]


def _gridded(model: Model, name: str, fit: WhiteFit) -> list[str]:
    """Parameters of the effect that are undefined without it."""
    return [label for label in _labels(model, name) if model.declared[label].none is None]


def _none_vector(model: Model, fit: WhiteFit, name: str | None = None, factor: float = 1.0) -> Tensor:
    """Raw vector of the model with the fit's values, and the added effects at no effect."""
    known = dict(zip(fit.model.labels(), fit.vector, strict=True))
    vector = model.vector().detach().clone()
    for i, label in enumerate(model.labels()):
        if label in known:
            vector[i] = known[label]
        elif label in model.declared:
            p = model.declared[label]
            vector[i] = p.to_raw(p.none if p.none is not None else factor * p.start)
    return vector


def _columns(
    model: Model, fit: WhiteFit, rows: Rows, whiten: Whitener, held: _Held | None, factor: float = 1.0
) -> dict[str, Tensor]:
    """Whitened derivative (2N,) with respect to each effect's raw parameter at no effect, by label."""
    vector = _none_vector(model, fit, factor=factor)
    places = [i for i, label in enumerate(model.labels()) if label not in fit.model.declared]
    if held is not None and all(e.late for e in model.effects if e.name not in _names(fit.model)):
        raw = _late_jacobian(model, vector, held)
    else:
        raw = Problem(model, rows, ONE).jacobians(vector[None])[0].reshape(len(rows), 2, -1)
    jacobian = whiten(raw[:, :, places]).flatten(0, 1)
    return {model.labels()[i]: column for i, column in zip(places, jacobian.T.contiguous(), strict=True)}


def _names(model: Model) -> set[str]:
    return {effect.name for effect in model.effects}


def _late_jacobian(model: Model, vector: Tensor, held: _Held) -> Tensor:
    """∂loads/∂vector (N, 2, p) through dissipation and measurement alone: the structure need not be solved again."""
    copies = vector.expand(len(held.loads), -1).clone().requires_grad_()
    values = model.physical(copies)
    loads = model.sensed(model.dissipated(held.loads, held.states, values), held.states, values)
    parts = []
    for load in loads.unbind(-1):
        (by_load,) = torch.autograd.grad(load.sum(), copies, retain_graph=True, materialize_grads=True)
        parts.append(by_load)
    return torch.stack(parts, dim=1)


def _grid(name: str, build: Build, fit: WhiteFit, rows: Rows, whiten: Whitener, held: _Held | None) -> Variants:
    model = build([name])
    fixed = _gridded(model, name, fit)
    return [(model, dict.fromkeys(fixed, f), _columns(model, fit, rows, whiten, held, f)) for f in GRID]


def _one(
    name: str,
    model: Model,
    fixed: dict[str, float],
    columns: dict[str, Tensor],
    fit: WhiteFit,
    absorbed: Tensor,
    whiten: Whitener,
    signs: Tensor,
    variance: float,
) -> EffectScore:
    free = [label for label in _labels(model, name) if label not in fixed]
    raw = torch.stack([columns[label] for label in free], dim=1)
    if not bool(raw.isfinite().all()):
        return EffectScore(name, status="failed", reason="its derivative at no effect is not finite")
    length = norms(raw)
    if bool((length == 0).all()):
        return EffectScore(name, status="not_testable", reason="it changes no load of these rows")
    unit = raw / length.clamp_min(1e-300)
    cleared = unit - absorbed @ (absorbed.T @ unit)
    cleared = cleared - absorbed @ (absorbed.T @ cleared)
    seen = norms(cleared) > ABSORBED
    if not bool(seen.any()):
        return EffectScore(
            name, status="not_testable", reason="refitting the model's own parameters absorbs it in these rows"
        )
    flat = fit.residual.reshape(-1)
    lower, upper = zip(*(_signs(model, label) for label in free), strict=True)
    low, high = np.array(lower)[seen.numpy()], np.array(upper)[seen.numpy()]
    signature = cleared[:, seen]
    # The same least squares in as few rows as there are unknowns.
    directions, triangle = torch.linalg.qr(signature)
    step = lsq_linear(triangle.numpy(), -(directions.T @ flat).numpy(), (low, high)).x
    gain = float(flat.square().sum() - (flat + signature @ torch.as_tensor(step)).square().sum())
    degrees = signature.shape[1]
    evidence = _evidence(np.array([gain / variance]), degrees)[0]
    null = _null(signature, flat, whiten, signs, variance, low, high)
    start = _none_vector(model, fit, factor=next(iter(fixed.values()), 1.0))
    places = [model.labels().index(label) for label, s in zip(free, seen.tolist(), strict=True) if s]
    moved = torch.as_tensor(step) / length[seen]
    start[places] += moved
    # The fit's own parameters give way to first order.
    known = [model.labels().index(label) for label in fit.model.labels()]
    start[known] -= _least_squares(fit.jacobian.flatten(0, 1), raw[:, seen] @ moved)
    bounds = model.raw_bounds()
    start = start.clamp(*bounds)
    return EffectScore(name, gain=gain, start=start, signature=signature, _evidence=evidence, _null=null)


def _least_squares(columns: Tensor, target: Tensor) -> Tensor:
    """x of least norm that minimises |columns x − target|, by scaled normal equations."""
    length = norms(columns).clamp_min(1e-300)
    scaled = columns / length
    return torch.linalg.pinv(scaled.T @ scaled, hermitian=True, rtol=1e-12) @ (scaled.T @ target) / length


def _signs(model: Model, label: str) -> tuple[float, float]:
    """Directions in which the parameter may leave no effect."""
    p = model.declared[label]
    if p.log:
        return -math.inf, math.inf
    return (0.0 if p.none == p.lower else -math.inf), (0.0 if p.none == p.upper else math.inf)


def _evidence(gain: np.ndarray, degrees: int) -> np.ndarray:
    """A reduction of χ² as a normal deviate: puts effects of one and of several parameters on one scale.

    Wilson & Hilferty's (1931) cube root, which neither saturates nor underflows where a p-value would.
    """
    share = 2 / (9 * degrees)
    return (np.cbrt(np.maximum(gain, 0) / degrees) - (1 - share)) / share**0.5


def _null(
    signature: Tensor, flat: Tensor, whiten: Whitener, signs: Tensor, variance: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Evidence in each draw of the bootstrap, (DRAWS,)."""
    products = (signature * flat[:, None]).reshape(len(whiten.state), 2, -1).sum(1)
    each = torch.zeros(whiten.states, products.shape[1], dtype=flat.dtype).index_add_(0, whiten.state, products)
    drawn = -(signs @ each)  # (DRAWS, q), slope of the residuals along the signature
    # One-sided: a slope into the bound promises nothing.
    drawn = torch.where((torch.as_tensor(low) == 0) & (drawn < 0), 0.0, drawn)
    drawn = torch.where((torch.as_tensor(high) == 0) & (drawn > 0), 0.0, drawn)
    gram = signature.T @ signature
    gain = (drawn * torch.linalg.solve(gram + 1e-12 * gram.trace() * torch.eye(len(gram)), drawn.T).T).sum(1)
    return _evidence((gain / variance).numpy(), signature.shape[1])
