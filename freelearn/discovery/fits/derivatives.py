"""Derivatives of whitened loads with respect to effects that are not in the model yet, at no effect."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.common.cores import side_by_side
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.white_fit import ONE, WhiteFit
from freelearn.discovery.noise.noise import Whitener
from freelearn.fitting.problem import Problem
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.row_derivatives import rows_jacobian
from freelearn.physics.effects.registry import EFFECTS

# Values tried for a parameter that is undefined without the effect (a time constant, say), as factors of its start: a
# fit moves it from there.
GRID = (0.2, 1.0, 5.0)

# A model with the fit's effects and some more: names → Model.
Build = Callable[[Sequence[str]], Model]


@dataclass(frozen=True)
class Trial:
    """An effect at no effect, its undefined parameters at `factor` times their start.

    model: the fit's with the effect; vector: its raw parameters there, (p,). labels: the effect's other parameters;
    columns: whitened derivatives by them, (2N, k).
    """

    effect: str
    model: Model
    vector: Tensor
    labels: tuple[str, ...]
    columns: Tensor


def trials(
    fit: WhiteFit, rows: Rows, whiten: Whitener, names: Sequence[str], build: Build, settled: Collection[str] = ()
) -> list[Trial]:
    """Every named effect at no effect, one trial for each value tried of its undefined parameters.

    settled: effects whose undefined parameters are where they should be."""
    carried = _carried(fit, rows)
    models = {name: build([name]) for name in names}
    gridded = [name for name, model in models.items() if name not in settled and _undefined(model, name)]
    tried = {factor: list(names) if factor == 1.0 else gridded for factor in GRID}
    asked = [(factor, group) for factor, some in tried.items() for group in _groups(some)]
    found = side_by_side([partial(_columns, build(some), fit, rows, whiten, carried, f) for f, some in asked])
    known: dict[float, dict[str, Tensor]] = {factor: {} for factor in GRID}
    for (factor, _), columns_of in zip(asked, found, strict=True):
        known[factor] |= columns_of
    out = []
    for factor, some in tried.items():
        for name in some:
            model = models[name]
            undefined = _undefined(model, name)
            labels = tuple(label for label in _labels(model, name) if label not in undefined)
            columns = torch.stack([known[factor][label] for label in labels], dim=1)
            out.append(Trial(name, model, none_vector(model, fit, factor), labels, columns))
    return out


def none_vector(model: Model, fit: WhiteFit, factor: float = 1.0) -> Tensor:
    """Raw vector (p,) of the model with the fit's values, and the added effects at no effect; parameters that are
    undefined there at `factor` times their start."""
    known = dict(zip(fit.model.labels(), fit.vector, strict=True))
    vector = model.vector().detach().clone()
    for i, label in enumerate(model.labels()):
        if label in known:
            vector[i] = known[label]
        elif label in model.declared:
            p = model.declared[label]
            vector[i] = p.to_raw(p.none if p.none is not None else factor * p.start)
    return vector


def _groups(names: Sequence[str]) -> list[list[str]]:
    """Effects whose derivatives are taken in one model each: series springs solve the whole chain several times over,
    so they are kept away from the energies, which are dear; what acts on the loads needs no structure at all."""
    energies = [n for n in names if EFFECTS[n].port == "energy"]
    springs = [n for n in names if EFFECTS[n].yields]
    late = [n for n in names if EFFECTS[n].late]
    rest = [n for n in names if n not in (*energies, *springs, *late)]
    return [group for group in (energies, springs, late, rest) if group]


class _Carried(NamedTuple):
    """What the fit's ideal actuators carry (N, 2), its derivative by the pressure (N, 2), and the states imposed on
    them, cut from every derivative."""

    states: States
    loads: Tensor
    by_pressure: Tensor


def _carried(fit: WhiteFit, rows: Rows) -> _Carried | None:
    """None where the state depends on the loads (a mount that gives way, a dead load) or on what was before, where
    loads are not all, and where they work through a lever."""
    if fit.model.remembers(rows.states):
        return None
    if fit.model.yielding or fit.model.levers or not rows.states.bed.loads or rows.states.members:
        return None
    with torch.no_grad():
        values = fit.model.physical(fit.vector)
        states = fit.model.imposed(rows.states, values)

    def ideal(pressure: Tensor) -> Tensor:
        return fit.model.ideal(states.replace(pressure=pressure[:, 0]), values).loads

    loads, by_pressure = rows_jacobian(ideal, states.pressure[:, None])
    return _Carried(states, loads, by_pressure[..., 0])


def _labels(model: Model, name: str) -> list[str]:
    return [label for label in model.declared if label.startswith(f"{name}.")]


def _undefined(model: Model, name: str) -> list[str]:
    """Parameters of the effect that are undefined without it."""
    return [label for label in _labels(model, name) if model.declared[label].none is None]


def _columns(
    model: Model, fit: WhiteFit, rows: Rows, whiten: Whitener, carried: _Carried | None, factor: float = 1.0
) -> dict[str, Tensor]:
    """Whitened derivative (2N,) with respect to each added effect's raw parameter at no effect, by label."""
    vector = none_vector(model, fit, factor)
    places = [i for i, label in enumerate(model.labels()) if label not in fit.model.declared]
    present = {effect.name for effect in fit.model.effects}
    added = [effect for effect in model.effects if effect.name not in present]
    if carried is not None and all(effect.late for effect in added):
        late = _late_jacobian(model, vector, carried)[..., places]
        raw = late * rows.readings.informative_mask(fit.shown)[..., None]
    else:
        near = None if fit.near is None else fit.near.copy()
        raw = Problem(model, rows, ONE, near).columns(vector, places)
    jacobian = whiten(raw).flatten(0, 1)
    return {model.labels()[i]: column for i, column in zip(places, jacobian.T.contiguous(), strict=True)}


def _late_jacobian(model: Model, vector: Tensor, carried: _Carried) -> Tensor:
    """∂loads/∂vector (N, 2, p) through dissipation and measurement alone: the structure need not be solved again.

    Where the wall keeps the share s of its stresses, loads(s, P) = s · loads(1, P/s) (see Chain.ideal), to first order
    loads + (s − 1) (loads − P ∂loads/∂P).
    """
    copies = vector.expand(len(carried.loads), -1).clone().requires_grad_()
    values = model.physical(copies)
    loads = carried.loads
    left = model.wall_left(carried.states, values)
    if left is not None:
        # The loads have what the fit's own effects leave already.
        change = (left / left.detach() - 1)[:, None]
        loads = loads + change * (loads - carried.states.pressure[:, None] * carried.by_pressure)
    loads = model.sensed(model.dissipated(loads, carried.states, values), carried.states, values)
    parts = []
    for load in loads.unbind(-1):
        (by_load,) = torch.autograd.grad(load.sum(), copies, retain_graph=True, materialize_grads=True)
        parts.append(by_load)
    return torch.stack(parts, dim=1)
