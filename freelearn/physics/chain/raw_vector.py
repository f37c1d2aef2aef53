"""A model's parameters as the vector that a fit moves: packing, bounds, labels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from freelearn.common.errors import UserError, unknown
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.parameters import Parameter

# Weights and physical parameters (SI) by name.
Values = dict[str, Tensor]


class RawVector(nn.Module):
    """Physical parameters, scalars in SI, and the raw parameters behind them: one unbounded (or bounded) number each.

    `physical` turns raw parameters into values. Everything is a function of a flat raw vector, so that fits, Jacobians
    and batches of restarts (vmap) need nothing else.
    """

    name: str
    # Declared parameters that are not each one's own raw number (the entries of a matrix).
    unnatural: ClassVar[frozenset[str]] = frozenset()
    # Which form of the raw numbers a checkpoint holds: one more where a model's became others.
    raw_form: ClassVar[int] = 1

    def __init__(self, declared: Mapping[str, Parameter], weights: Mapping[str, tuple[int, ...]] | None = None) -> None:
        """declared: physical parameters by name. weights: shapes of parameters without physical meaning."""
        super().__init__()
        self.weights = dict(weights or {})
        self.declared = dict(declared)
        self.raw = nn.ParameterDict()
        self.known = Known()

    def learn(self, known: Known) -> None:
        """Takes over what a user knows of the parameters beforehand. Raises UserError."""
        if known.nothing:
            return
        values = self.scalars()
        for label, p in self.declared.items():
            self._check(label, known)
            self.declared[label], values[label] = known.told(label, p, values[label])
        # What builds the model again needs the values that hold.
        held = {label: values[label] for label, p in self.declared.items() if p.fixed}
        self.known = replace(known, starts={**known.starts, **held})
        self.set_values(values)

    def beforehand(self) -> dict[str, str]:
        """What was known of parameters before a fit, in words, by label."""
        told = {label: self.known.words(label, p) for label, p in self.declared.items()}
        return {label: words for label, words in told.items() if words}

    def _check(self, label: str, known: Known) -> None:
        """Whether what is known of a parameter can be. Raises UserError."""
        if label in self.unnatural and (known.holds(label) or known.bounded(label) or known.prior(label)):
            raise UserError(
                f"{label} of model {self.name} cannot be fixed, bounded or known alone: a fit moves the whole matrix."
            )

    @property
    def free(self) -> Tensor:
        """Which entries of the raw vector a fit moves, (p,) bool."""
        moved = [True] * (len(self.vector()) - len(self.declared)) + [not p.fixed for p in self.declared.values()]
        return torch.tensor(moved, dtype=torch.bool)

    def set_values(self, values: Mapping[str, float]) -> None:
        """Sets physical parameters by name, in SI; those not named keep their value. Raises UserError."""
        for name, value in values.items():
            if name not in self.declared:
                raise unknown(f"parameter of model {self.name}:", name, self.declared)
            spec = self.declared[name]
            if not spec.allows(value):
                limits = f"{max(spec.lower, 0) if spec.log else spec.lower:g} … {spec.upper:g}"
                raise UserError(f"{name} = {value:g} {spec.unit} is not possible: choose a value in {limits}.")
        now = self.scalars() if len(self.raw) else {}
        wanted = {n: p.start for n, p in self.declared.items()} | now | {n: float(v) for n, v in values.items()}
        if not len(self.raw):
            for name, shape in self.weights.items():
                self.raw[name] = nn.Parameter(torch.zeros(shape, dtype=torch.float64))
        for name, tensor in self.to_raw(wanted).items():
            # A dot would read as a submodule in the parameter's name.
            self.raw[name.replace(".", "__")] = nn.Parameter(tensor)

    def scalars(self) -> dict[str, float]:
        """The declared physical parameters as numbers, in SI."""
        with torch.no_grad():
            values = self.values()
        return {name: float(values[name]) for name in self.declared}

    def values(self) -> Values:
        """Weights and physical parameters (SI) by name."""
        return self.physical(self.vector())

    def vector(self) -> Tensor:
        """All raw parameters as one vector, (p,)."""
        if not len(self.raw):
            return torch.zeros(0, dtype=torch.float64)
        return torch.cat([p.reshape(-1) for p in self.raw.values()])

    def set_vector(self, vector: Tensor) -> None:
        """Takes over a raw vector (p,)."""
        start = 0
        for p in self.raw.values():
            p.data.copy_(vector[start : start + p.numel()].reshape(p.shape))
            start += p.numel()

    def labels(self) -> list[str]:
        """A name for every entry of the raw vector: hidden_weight[0,3], C1, …"""
        names = [
            f"{name}[{','.join(map(str, index))}]"
            for name, shape in self.weights.items()
            for index in product(*map(range, shape))
        ]
        return [*names, *self.declared]

    def raw_bounds(self) -> tuple[Tensor, Tensor]:
        """Lower and upper bounds of the raw vector, each (p,)."""
        free = [(-math.inf, math.inf)] * sum(math.prod(shape) for shape in self.weights.values())
        pairs = free + [p.raw_bounds for p in self.declared.values()]
        bounds = torch.tensor(pairs, dtype=torch.float64).reshape(-1, 2)
        return bounds[:, 0], bounds[:, 1]

    def to_raw(self, values: Mapping[str, float]) -> Values:
        """Raw parameters from the declared physical ones."""
        return {name: p.to_raw(values[name]) for name, p in self.declared.items()}

    def physical(self, vector: Tensor) -> Values:
        """Weights and physical parameters (SI) from a raw vector (p,), differentiable.

        One vector per row, (N, p), gives one value per row: parameters (N,), weights (N, …).
        """
        values: Values = {}
        start = 0
        for name, shape in self.weights.items():
            size = math.prod(shape)
            values[name] = vector[..., start : start + size].unflatten(-1, shape)
            start += size
        # Taken apart in one piece: the derivative is then put together in one piece too.
        for (name, p), raw in zip(self.declared.items(), vector[..., start:].unbind(-1), strict=True):
            values[name] = p.to_physical(raw)
        return values

    def rows_of(self, values: Values, rows: Tensor | slice) -> Values:
        """Values for some rows: those that differ from row to row are picked, the others kept. rows: (n,) int64, or a
        slice."""
        return {
            name: value[rows] if value.ndim > len(self.weights.get(name, ())) else value
            for name, value in values.items()
        }

    def from_older(self, state: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """What `state` gave when the raw numbers had their form before this one, in the present form."""
        return dict(state)

    def state(self) -> dict[str, Any]:
        """The raw parameters and buffers, cut from every derivative, for a checkpoint."""
        return {name: tensor.detach().clone() for name, tensor in self.state_dict().items()}
