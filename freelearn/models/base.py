"""What every model is: the chain from an imposed state to the loads that the sensors show."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, Protocol

import torch
from torch import Tensor, nn

from freelearn.errors import UserError
from freelearn.measurements.states import States
from freelearn.models.mount import settle
from freelearn.models.parameter import Parameter
from freelearn.models.ports import PORTS, Effect
from freelearn.models.prediction import Prediction

# Rows predicted at once: few enough for what one operation reads to stay in the processor's cache.
BLOCK = 4096

Values = dict[str, Tensor]


class Bound(Protocol):
    """A model at fixed states, as a fit asks for it again and again: no status, nothing recorded for autograd."""

    def loads(self, vector: Tensor) -> Tensor:
        """Loads (N, 2) N, N·m at a raw vector (p,)."""

    def jacobian(self, vector: Tensor) -> Tensor:
        """∂loads/∂vector of every row, (N, 2, p)."""


class Model(nn.Module):
    """boundary → geometry → loads of the structure → dissipation → measurement, with the named effects inside.

    A model's physical parameters are scalars in SI. What a fit moves are the raw parameters, one unbounded (or
    box-bounded) number each; `physical` turns them into values. Everything is a function of a flat raw vector,
    so that fits, Jacobians and batches of restarts (vmap) need nothing else.
    """

    name: str
    # Which effects it can take (Effect.models): its own name, or that of the model that it is a variant of.
    family: str
    # Whether a fit needs rows held back to know when to stop.
    needs_validation = False
    # Whether a fit may end in different minima from different starts, so that restarts help.
    needs_restarts = False

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if not hasattr(cls, "family"):
            cls.family = cls.name

    def __init__(
        self,
        declared: Sequence[Parameter],
        effects: Sequence[Effect] = (),
        weights: Mapping[str, tuple[int, ...]] | None = None,
    ) -> None:
        """declared: the model's own physical parameters. weights: shapes of parameters without physical meaning."""
        super().__init__()
        self.weights = dict(weights or {})
        self.effects = tuple(effects)
        self.declared = {p.name: p for p in declared}
        # Reading an effect's parameters costs something, so each is asked only in its own place.
        self._at_port: dict[str, list[Effect]] = {port: [] for port in PORTS}
        for effect in self.effects:
            self.declared |= effect.declared()
            self._at_port[effect.port()].append(effect)
        self.raw = nn.ParameterDict()

    # --- parameters ------------------------------------------------------------------------------------------

    def set_values(self, values: Mapping[str, float]) -> None:
        """Sets physical parameters by name, in SI; those not named keep their value. Raises UserError."""
        for name, value in values.items():
            if name not in self.declared:
                raise UserError(_unknown(f"parameter of model {self.name}", name, self.declared))
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
        """The physical parameters in SI, by name."""
        return self.physical(self.vector())

    def vector(self) -> Tensor:
        """All raw parameters as one vector, (p,)."""
        return torch.cat([p.reshape(-1) for p in self.raw.values()]) if len(self.raw) else torch.zeros(0)

    def set_vector(self, vector: Tensor) -> None:
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
        free = [(-math.inf, math.inf)] * self._weight_count
        pairs = free + [p.raw_bounds for p in self.declared.values()]
        bounds = torch.tensor(pairs, dtype=torch.float64).reshape(-1, 2)
        return bounds[:, 0], bounds[:, 1]

    def to_raw(self, values: Mapping[str, float]) -> dict[str, Tensor]:
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

    @property
    def _weight_count(self) -> int:
        return sum(math.prod(shape) for shape in self.weights.values())

    def description(self) -> dict[str, Any]:
        """Everything needed to rebuild the model, as plain containers and tensors (see models.checkpoint)."""
        state = {name: tensor.detach().clone() for name, tensor in self.state_dict().items()}
        samples = sorted({sample for effect in self.effects for sample in effect.samples})
        return {"model": self.name, "effects": [e.name for e in self.effects], "samples": samples, "state": state}

    # --- the chain -------------------------------------------------------------------------------------------

    def forward(self, states: States, values: Values | None = None) -> Prediction:
        """Loads of N states: States → loads (N, 2) N, N·m and status (N,)."""
        values = self.values() if values is None else values
        if len(states) > BLOCK:
            blocks = [self.chain(states[slice(i, i + BLOCK)], values) for i in range(0, len(states), BLOCK)]
            return Prediction(torch.cat([b.loads for b in blocks]), torch.cat([b.status for b in blocks]))
        return self.chain(states, values)

    def chain(self, states: States, values: Values) -> Prediction:
        """`forward` in one block, with values that may differ from row to row."""
        states = self.imposed(states, values)
        if self.yielding:

            def impose(states: States, loads: Tensor, values: Values) -> States:
                for effect in self.yielding:
                    states = effect.impose(states, effect.own(values, states), loads)  # type: ignore[call-arg]
                return states

            def carried(states: States, values: Values) -> Prediction:
                loads, status = self.ideal(states, values)
                return Prediction(self.dissipated(loads, states, values), status)

            states, (loads, status) = settle(states, values, impose, carried)
        else:
            loads, status = self.ideal(states, values)
            loads = self.dissipated(loads, states, values)
        return Prediction(self.sensed(loads, states, values), status)

    @property
    def yielding(self) -> list[Effect]:
        """Boundary effects whose imposed state depends on the loads."""
        return [effect for effect in self._at_port["boundary"] if effect.load_dependent]

    def imposed(self, states: States, values: Values) -> States:
        """The states that were really imposed on the actuator and its mount."""
        for effect in self._at_port["boundary"]:
            if not effect.load_dependent:
                states = effect.impose(states, effect.own(values, states))
        return states

    def ideal(self, states: States, values: Values) -> Prediction:
        """Loads of the actuator as it really is, at the state that was really imposed: geometry → structure."""
        shaped = states
        for effect in self._at_port["geometry"]:
            shaped = effect.reshape(shaped, effect.own(values, states))
        return self.structure(shaped, values)

    def dissipated(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """What of the ideal actuator's loads reaches the mount."""
        for effect in self._at_port["dissipation"]:
            loads = effect.dissipate(loads, states, effect.own(values, states))
        return loads

    def sensed(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """What the sensors show of the loads on the mount."""
        for effect in self._at_port["measurement"]:
            loads = effect.sense(loads, states, effect.own(values, states))
        return loads

    def structure(self, states: States, values: Values) -> Prediction:
        """Loads of the ideal actuator at the state that was really imposed. The one method a model must write."""
        raise NotImplementedError

    def remarks(self) -> list[str]:
        """Sentences on the present parameters that a reader of a fit should know. None by default."""
        return []

    # --- what a fit asks -------------------------------------------------------------------------------------

    def prepare(self, states: States, loads: Tensor) -> None:
        """Looks at the training rows before a fit (input scaling). Nothing by default."""

    def row_jacobian(self, states: States, vector: Tensor) -> Tensor | None:
        """∂loads/∂vector of every row, (N, 2, p), where the model has it in closed form; None leaves it to autograd."""
        return None

    def bind(self, states: States) -> Bound | None:
        """The model at fixed states, where something can be made once for all raw vectors; None by default."""
        return None

    def starts(self, states: States, loads: Tensor, members: int, generator: torch.Generator) -> Tensor:
        """Raw vectors from which a fit may start: (members, p)."""
        return self.vector().detach().expand(members, -1).clone()


def _unknown(what: str, name: str, known: Mapping[str, object]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return f"Unknown {what}: {name!r}.{hint} Known: {', '.join(known)}."
