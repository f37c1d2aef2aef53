"""The paper's linear lumped-parameter model: an inextensible fiber helix around fluid, and a stiffness matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.model import Model, Values
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.mechanics.inextensible import helix

# A fitted K whose determinant is below this share of ka·kb is at the edge.
AT_EDGE = 1e-6


class Stiffness(Parameters):
    """ka [N/m], kb [N·m/rad], kc [N/rad]: the entries of K."""

    ka: Tensor = parameter("kₐ", "N/m", start=1e3, lower=0.0)
    kb: Tensor = parameter("k_b", "N·m/rad", start=1e-1, lower=0.0)
    kc: Tensor = parameter("k_c", "N/rad", start=0.0)


class Linear(Model[Stiffness]):
    """τ = J_Vᵀ P − K (l − L, φ), K = [[ka, kc], [kc, kb]] symmetric positive definite.

    ka [N/m], kb [N·m/rad], kc [N/rad]. A fit moves ln ka, ln kb and the coupling kc/√(ka kb), which the bounds ±1 keep
    K positive definite by: from a bound it comes back, where a factor of K whose logarithm has gone tells nothing more.
    Fluid: V = π (l B² − l³)/(Φ + φ)² with B = L/cos Γ and Φ = (L/R_o) tan Γ (Bruder et al. 2018; the paper's
    Eq. linearVolume); of two families of fibers see inextensible.
    """

    name = "linear"
    family = "linear"
    parameter_class = Stiffness
    conservative = True
    relaxed_at_rest = True
    unnatural = frozenset({"ka", "kb", "kc"})
    raw_form = 2

    def __init__(self, ka: float = 1e3, kb: float = 1e-1, kc: float = 0.0, effects: Sequence[Effect[Any]] = ()) -> None:
        super().__init__(effects, ka=ka, kb=kb, kc=kc)

    def to_raw(self, values: Mapping[str, float]) -> Values:
        """As RawVector.to_raw, K by its coupling. Raises UserError where K is not positive definite."""
        ka, kb, kc = values["ka"], values["kb"], values["kc"]
        if ka <= 0 or kb <= 0 or kc * kc > ka * kb * (1 + 1e-9):
            raise UserError(
                f"ka = {ka:g}, kb = {kb:g}, kc = {kc:g} do not make a positive definite stiffness matrix: "
                "choose ka > 0, kb > 0 and kc² < ka·kb."
            )
        entries = {"ka": math.log(ka), "kb": math.log(kb), "kc": min(max(kc / math.sqrt(ka * kb), -1.0), 1.0)}
        return super().to_raw(values) | {k: torch.tensor(v, dtype=torch.float64) for k, v in entries.items()}

    def raw_bounds(self) -> tuple[Tensor, Tensor]:
        """As RawVector.raw_bounds, of the coupling those within which K is positive definite."""
        lower, upper = super().raw_bounds()
        lower[:3], upper[:3] = (
            lower.new_tensor([-math.inf, -math.inf, -1.0]),
            upper.new_tensor([math.inf, math.inf, 1.0]),
        )
        return lower, upper

    def physical(self, vector: Tensor) -> Values:
        """As RawVector.physical, K from its coupling."""
        values = super().physical(vector)
        a, b, coupling = vector[..., 0], vector[..., 1], vector[..., 2]
        return values | {"ka": a.exp(), "kb": b.exp(), "kc": coupling * ((a + b) / 2).exp()}

    def from_older(self, state: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """As RawVector.from_older: K was kept as its Cholesky factors, C = [[e^a, 0], [c, e^b]]."""
        a, b, c = state["raw.ka"], state["raw.kb"], state["raw.kc"]
        kb = c * c + (2 * b).exp()
        return {**state, "raw.ka": 2 * a, "raw.kb": kb.log(), "raw.kc": (c / kb.sqrt()).clamp(-1.0, 1.0)}

    def remarks(self) -> list[str]:
        """Says when K sits at the edge of positive definiteness, where the constrained optimum of a fit may lie."""
        k = self.scalars()
        if k["ka"] * k["kb"] - k["kc"] ** 2 < AT_EDGE * k["ka"] * k["kb"]:
            return [
                "K is at the edge of positive definiteness (kc² ≈ ka·kb): without that constraint the rows would "
                "prefer a wall that gives energy away, so the model lacks something here."
            ]
        return []

    def structure(self, states: States, p: Stiffness) -> Prediction:
        """Loads of fluid and wall; a row at a singular angle or past the fiber's length is marked."""
        fibers, stretch = helix(states), states.length - states.reference_length
        force = math.pi * fibers.by_length * states.pressure - p.ka * stretch - p.kc * states.twist
        moment = math.pi * fibers.by_twist * states.pressure - p.kc * stretch - p.kb * states.twist
        status = torch.where(fibers.radius2 < 0, Status.OVERSTRETCHED, Status.OK)
        status = torch.where(fibers.singular, Status.SINGULAR, status).to(torch.uint8)
        return Prediction(torch.stack([force, moment], dim=-1), status)

    def diameter(self, states: States, values: Values) -> Tensor:
        """As Chain.diameter: the fibers' own, which does not depend on K."""
        return 2 * helix(states).radius2.clamp_min(0.0).sqrt()
