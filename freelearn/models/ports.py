"""An effect: physics that a model leaves out, as a part that plugs into one stop of the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.energy import Energy
from freelearn.models.parameter import Parameter

# The stops of the chain, and the method that plugs into each.
PORTS = {
    "boundary": "impose",
    "geometry": "reshape",
    "energy": "psi",
    "dissipation": "dissipate",
    "measurement": "sense",
}


class Effect:
    """Base of all effects. A subclass declares its name, parameters and models, and overrides one of five methods.

    boundary: `impose` changes the state that was really imposed; geometry: `reshape` changes the actuator's
    design; energy: `psi` adds a strain energy; dissipation: `dissipate` and measurement: `sense` change the loads.
    Each gets `p`, its own parameters by name in SI, as scalars or one per row, (N,). With every parameter at its
    no-effect value the model is unchanged.
    """

    name: ClassVar[str]
    parameters: ClassVar[Sequence[Parameter]] = ()
    # Families of models that it can join.
    models: ClassVar[tuple[str, ...]] = ("continuum", "linear", "mlp")
    # When to suspect it, in a researcher's words, and where it is described.
    suspect: ClassVar[str] = ""
    source: ClassVar[str] = ""
    # Columns of the table that it needs besides the required ones.
    needs: ClassVar[tuple[str, ...]] = ()
    # Invariants that `psi` takes.
    depends_on: ClassVar[tuple[str, ...]] = ()
    # Whether the state that it imposes depends on the loads: `impose` then takes them as a third argument.
    load_dependent: ClassVar[bool] = False

    def __init__(self, samples: Sequence[int] = ()) -> None:
        """samples: those of a fit; with several, a `per_sample` parameter has one value for each."""
        distinct = tuple(sorted(set(samples)))
        self.samples = distinct if len(distinct) > 1 else ()

    @classmethod
    def port(cls) -> str:
        """boundary, geometry, energy, dissipation or measurement. Raises TypeError unless it is exactly one."""
        found = [port for port, method in PORTS.items() if getattr(cls, method) is not getattr(Effect, method)]
        if len(found) != 1:
            overridden = ", ".join(PORTS[port] for port in found) or "none"
            raise TypeError(f"must override exactly one of {', '.join(PORTS.values())}; it overrides {overridden}")
        return found[0]

    def declared(self) -> dict[str, Parameter]:
        """Its parameters by the name that they have in a model: effect.name, or effect.name[3] for sample 3."""
        return {label: p for p in self.parameters for label in self._labels(p)}

    def _labels(self, p: Parameter) -> list[str]:
        whole = f"{self.name}.{p.name}"
        return [f"{whole}[{sample}]" for sample in self.samples] if p.per_sample and self.samples else [whole]

    def own(self, values: Mapping[str, Tensor], states: States | None = None) -> SimpleNamespace:
        """This effect's parameters out of the model's values, each () or (N,).

        A row takes its own sample's value; a sample that was not fitted takes the mean of those that were.
        """
        found = {}
        for p in self.parameters:
            each = [values[label] for label in self._labels(p)]
            found[p.name] = each[0] if len(each) == 1 else self._of_rows(torch.stack(each, dim=-1), states)
        return SimpleNamespace(**found)

    def _of_rows(self, each: Tensor, states: States | None) -> Tensor:
        """Values of the samples, (S,) or (N, S), to one value per row, (N,)."""
        assert states is not None
        match = states.sample[:, None] == torch.tensor(self.samples, device=states.sample.device)
        share = torch.where(match.any(1, keepdim=True), match.to(each.dtype), 1 / len(self.samples))
        return (share * each).sum(-1)

    # --- the five ports --------------------------------------------------------------------------------------

    def impose(self, states: States, p: Any) -> States:
        """The states that were really imposed, from those that the table shows."""
        return states

    def reshape(self, states: States, p: Any) -> States:
        """The actuators as they really are."""
        return states

    def psi(self, *invariants: Tensor, p: Any, material: Mapping[str, Tensor]) -> Tensor:
        """Added strain energy [Pa] at the invariants of `depends_on`; material: the model's own C1, C2."""
        raise NotImplementedError

    def dissipate(self, loads: Tensor, states: States, p: Any) -> Tensor:
        """Loads (N, 2) N, N·m that reach the mount, from those of the ideal actuator."""
        return loads

    def sense(self, loads: Tensor, states: States, p: Any) -> Tensor:
        """Loads (N, 2) N, N·m that the sensors show, from those on the mount."""
        return loads

    # --- energy ----------------------------------------------------------------------------------------------

    def psi_gradient(self, *invariants: Tensor, p: Any, material: Mapping[str, Tensor]) -> tuple[Tensor, ...]:
        """∂psi/∂I for each invariant [Pa]. Automatic; an effect may write it by hand for speed."""

        def total(*args: Tensor) -> Tensor:
            return self.psi(*args, p=p, material=material).sum()

        return torch.func.grad(total, argnums=tuple(range(len(invariants))))(*invariants)

    def psi_hessian(
        self, *invariants: Tensor, p: Any, material: Mapping[str, Tensor]
    ) -> tuple[tuple[Tensor, ...], ...] | None:
        """∂²psi/∂I∂I [Pa], row by row. None leaves it to autograd; an effect may write it by hand for speed."""
        return None

    def energy_terms(self, values: Mapping[str, Tensor]) -> list[Energy]:
        """The strain energies that the effect adds, as mechanics sees them."""
        if not self.depends_on:
            return []
        material = {name: values[name] for name in ("C1", "C2")}
        return [EffectEnergy(self, self.own(values), material)]


@dataclass(frozen=True)
class EffectEnergy(Energy):
    """An effect's `psi` with its parameters filled in."""

    effect: Effect
    p: SimpleNamespace
    material: Mapping[str, Tensor]

    @property
    def depends_on(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.effect.depends_on

    @property
    def idle(self) -> bool:
        """Whether every parameter that can stand for no effect does; False inside vmap, where nobody can know."""
        telling = [p for p in self.effect.parameters if p.none is not None]
        try:
            return bool(telling) and all(bool((getattr(self.p, p.name) == p.none).all()) for p in telling)
        except RuntimeError:
            return False

    def psi(self, *invariants: Tensor) -> Tensor:
        return self.effect.psi(*invariants, p=self.p, material=self.material)

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        return self.effect.psi_gradient(*invariants, p=self.p, material=self.material)

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        hessian = self.effect.psi_hessian(*invariants, p=self.p, material=self.material)
        if hessian is not None:
            along = tuple(
                sum((h * rate for h, rate in zip(row[1:], rates[1:], strict=True)), start=row[0] * rates[0])
                for row in hessian
            )
            return self.gradient(*invariants), along
        # The second derivatives are symmetric, so the reverse product is the forward one, several times quicker.
        value, pull = torch.func.vjp(self.gradient, *invariants)  # type: ignore[misc]
        return value, pull(tuple(rate.expand_as(v) for rate, v in zip(rates, value, strict=True)))

    def detach(self) -> EffectEnergy:
        still = SimpleNamespace(**{name: value.detach() for name, value in vars(self.p).items()})
        return EffectEnergy(self.effect, still, {n: v.detach() for n, v in self.material.items()})


def columns(force: Tensor, moment: Tensor) -> Tensor:
    """Loads (N, 2) from force [N] and moment [N·m], each scalar or (N,)."""
    return torch.stack(torch.broadcast_tensors(force, moment), dim=-1)


def per_row(value: Tensor) -> Tensor:
    """A parameter, () or (N,), that multiplies loads (N, 2)."""
    return value[..., None]
