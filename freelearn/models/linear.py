"""The paper's linear lumped-parameter model: an inextensible fibre helix around fluid, and a stiffness matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.fit.stiffness import best_stiffness
from freelearn.measurements.error import load_scale
from freelearn.measurements.states import States
from freelearn.models.base import Model, Values
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect
from freelearn.models.prediction import Prediction, Status

# Fibres unwound to within this share of their angle Φ count as parallel to the axis.
SINGULAR_SHARE = 0.02
# A start on (or within this of) the edge of positive definiteness is moved this far inside.
EDGE = 1e-12
# Smallest stiffness of a start [N/m, N·m/rad]: rubber is far stiffer, and the logarithm needs something.
FLOOR = {"ka": 1e-6, "kb": 1e-12}
# A fitted K whose determinant is below this share of ka·kb is at the edge.
AT_EDGE = 1e-6


class Linear(Model):
    """τ = J_Vᵀ P − K (l − L, φ), K = [[ka, kc], [kc, kb]] symmetric positive definite.

    ka [N/m], kb [N·m/rad], kc [N/rad]. K = C Cᵀ with C = [[e^a, 0], [c, e^b]] is positive definite whatever a fit
    does to (a, c, b) (the log-Cholesky form of Pinheiro & Bates 1996).
    Fluid: V = π (l B² − l³)/(Φ + φ)² with B = L/cos Γ and Φ = (L/R_o) tan Γ (Bruder et al. 2018; the paper's
    Eq. linearVolume).
    """

    name = "linear"

    def __init__(self, ka: float = 1e3, kb: float = 1e-1, kc: float = 0.0, effects: Sequence[Effect] = ()) -> None:
        declared = [
            Parameter("ka", "kₐ", "N/m", start=1e3, lower=0.0),
            Parameter("kb", "k_b", "N·m/rad", start=1e-1, lower=0.0),
            Parameter("kc", "k_c", "N/rad", start=0.0),
        ]
        super().__init__(declared, effects)
        self.set_values({"ka": ka, "kb": kb, "kc": kc})

    def to_raw(self, values: Mapping[str, float]) -> dict[str, Tensor]:
        ka, kb, kc = values["ka"], values["kb"], values["kc"]
        if ka <= 0 or kb <= 0 or kc * kc > ka * kb * (1 + 1e-9):
            raise UserError(
                f"ka = {ka:g}, kb = {kb:g}, kc = {kc:g} do not make a positive definite stiffness matrix: "
                "choose ka > 0, kb > 0 and kc² < ka·kb."
            )
        # Cholesky factors. A start such as the paper's ka = kb = kc = 1 lies on the edge, where b is −∞.
        rest = max(kb - kc * kc / ka, EDGE * kb)
        raw = super().to_raw(values)
        raw |= {
            "ka": torch.tensor(math.log(ka) / 2, dtype=torch.float64),
            "kb": torch.tensor(math.log(rest) / 2, dtype=torch.float64),
            "kc": torch.tensor(kc / math.sqrt(ka), dtype=torch.float64),
        }
        return raw

    def raw_bounds(self) -> tuple[Tensor, Tensor]:
        lower, upper = super().raw_bounds()
        lower[:3], upper[:3] = -math.inf, math.inf
        return lower, upper

    def physical(self, vector: Tensor) -> Values:
        values = super().physical(vector)
        a, b, c = vector[..., 0].exp(), vector[..., 1].exp(), vector[..., 2]
        return values | {"ka": a * a, "kb": c * c + b * b, "kc": a * c}

    def remarks(self) -> list[str]:
        """Says when K sits at the edge of positive definiteness, where the constrained optimum of a fit may lie."""
        k = self.scalars()
        if k["ka"] * k["kb"] - k["kc"] ** 2 < AT_EDGE * k["ka"] * k["kb"]:
            return [
                "K is at the edge of positive definiteness (kc² ≈ ka·kb): without that constraint the rows would "
                "prefer a wall that gives energy away, so the model lacks something here."
            ]
        return []

    def structure(self, states: States, values: Values) -> Prediction:
        length, reference = states.length, states.reference_length
        fiber2 = (reference / torch.cos(states.fiber_angle)) ** 2
        wrap = reference / states.outer_radius * torch.tan(states.fiber_angle)
        turned = wrap + states.twist
        singular = turned.abs() < SINGULAR_SHARE * wrap
        # The row is marked; a finite number keeps it from breaking a loss that it is not part of.
        turned = torch.where(singular, SINGULAR_SHARE * wrap, turned)
        stretch = length - reference
        length2 = length * length
        force = math.pi * (fiber2 - 3 * length2) / turned**2 * states.pressure
        moment = -2 * math.pi * length * (fiber2 - length2) / turned**3 * states.pressure
        force = force - values["ka"] * stretch - values["kc"] * states.twist
        moment = moment - values["kc"] * stretch - values["kb"] * states.twist
        status = torch.where(length2 > fiber2, Status.OVERSTRETCHED, Status.OK)
        status = torch.where(singular, Status.SINGULAR, status).to(torch.uint8)
        return Prediction(torch.stack([force, moment], dim=-1), status)

    def starts(self, states: States, loads: Tensor, members: int, generator: torch.Generator) -> Tensor:
        """The best K for the present effects, exactly, whatever the model's own K: a fit has only to polish it."""
        scale = load_scale(loads)
        values = {name: value.detach() for name, value in self.values().items()}

        def scaled(k: Tensor) -> Tensor:
            named = values | {"ka": k[0], "kb": k[1], "kc": k[2]}
            return (self(states, named).loads / scale).reshape(-1)

        origin = torch.zeros(3, dtype=torch.float64)
        usable = (self(states).status == Status.OK).repeat_interleave(2)
        target = ((loads / scale).reshape(-1) - scaled(origin))[usable]
        ka, kb, kc = best_stiffness(torch.func.jacfwd(scaled)(origin)[usable], target)
        ka, kb = max(ka, FLOOR["ka"]), max(kb, FLOOR["kb"])
        limit = math.sqrt(ka * kb)
        found = {"ka": ka, "kb": kb, "kc": min(max(kc, -limit), limit)}
        raw = self.to_raw(self.scalars() | found)
        return torch.stack([raw[name] for name in self.declared]).expand(members, -1).clone()
