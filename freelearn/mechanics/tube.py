"""Kinematics of a thick-walled tube that is stretched, twisted and inflated, at radii through its wall."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np
import torch
from torch import Tensor

from freelearn.measurements.states import States

# Gauss-Legendre points through the wall. The integrands are smooth: six reach 1e-9 of the load range over the
# paper's samples and protocol (tests/mechanics measures it).
QUADRATURE_POINTS = 6


@lru_cache
def _gauss_legendre(points: int) -> tuple[Tensor, Tensor]:
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return torch.as_tensor(nodes), torch.as_tensor(weights)


@dataclass(frozen=True)
class Tube:
    """Everything about N deformed tubes that does not depend on their inner radius.

    The wall is followed by Q points of the reference wall, R in [R_i, R_o], so the integration limits are
    fixed. Incompressibility gives the current radius, r² = u + (R² − R_i²)/λz, from the one unknown
    u = r_i² [m²]. With k = φ/L and g = sin Γ/R + k cos Γ the fibre's circumferential stretch is r g.

    (Q, N) tensors: weight (twice the quadrature weight times R/λz: 2 ∫ f r dr = Σ weight f) [m²],
    offset (R² − R_i²)/λz [m²], radial (R/λz)² [m²], hoop 1/R² + k² [1/m²], fiber_hoop g [1/m].
    fiber_hoop2 is g². (N,) tensors: axial λz, axial2 λz², twist_rate k [1/m], fiber_axial λz cos Γ and its square
    fiber_axial2, reference_u R_i² [m²].
    """

    weight: Tensor
    offset: Tensor
    radial: Tensor
    hoop: Tensor
    fiber_hoop: Tensor
    fiber_hoop2: Tensor
    axial: Tensor
    axial2: Tensor
    twist_rate: Tensor
    fiber_axial: Tensor
    fiber_axial2: Tensor
    reference_u: Tensor

    @classmethod
    def from_states(cls, states: States, points: int = QUADRATURE_POINTS) -> Tube:
        nodes, weights = _gauss_legendre(points)
        nodes, weights = nodes.to(states.length)[:, None], weights.to(states.length)[:, None]
        half = (states.outer_radius - states.inner_radius) / 2
        radius = states.inner_radius + half * (1 + nodes)
        axial = states.length / states.reference_length
        twist_rate = states.twist / states.reference_length
        cosine = torch.cos(states.fiber_angle)
        inverse = torch.reciprocal(radius)
        squared = radius * radius
        axial2 = axial * axial
        fiber_axial = axial * cosine
        fiber_hoop = torch.sin(states.fiber_angle) * inverse + twist_rate * cosine
        reference_u = states.inner_radius**2
        return cls(
            weight=(2 * weights) * (half / axial) * radius,
            offset=(squared - reference_u) / axial,
            radial=squared / axial2,
            hoop=inverse * inverse + twist_rate**2,
            fiber_hoop=fiber_hoop,
            fiber_hoop2=fiber_hoop * fiber_hoop,
            axial=axial,
            axial2=axial2,
            twist_rate=twist_rate,
            fiber_axial=fiber_axial,
            fiber_axial2=fiber_axial * fiber_axial,
            reference_u=reference_u,
        )

    def detach(self) -> Tube:
        return Tube(**{f.name: getattr(self, f.name).detach() for f in fields(self)})


class Deformation:
    """A tube inflated to inner radius √u: components of B = F Fᵀ and the invariants, (Q, N), each made once.

    B_rr = (R/λz)²/r², B_θθ = r² (1/R² + k²), B_θz = r k λz, B_zz = λz²;
    I₁ = tr B, I₂ = tr B⁻¹ (det B = 1), I₄ = r² g² + λz² cos² Γ, the fibre's squared stretch.
    A `*_rate` is the derivative with respect to u, which is the derivative with respect to r² at fixed R.
    """

    def __init__(self, tube: Tube, u: Tensor) -> None:
        self.tube = tube
        self.r2 = u + tube.offset
        self.inverse_r2 = torch.reciprocal(self.r2)
        self.b_rr = tube.radial * self.inverse_r2

    @cached_property
    def thinning(self) -> Tensor:
        """B_rr/r² = −∂B_rr/∂u."""
        return self.b_rr * self.inverse_r2

    @property
    def i1(self) -> Tensor:
        return self.b_rr + self.r2 * self.tube.hoop + self.tube.axial2

    @property
    def i1_rate(self) -> Tensor:
        return self.tube.hoop - self.thinning

    @property
    def i2(self) -> Tensor:
        # B is block diagonal (rr | θθ, θz, zz) with det B = 1, so its principal minors sum to this.
        return torch.reciprocal(self.b_rr) + self.b_rr * (self.r2 * self.tube.hoop + self.tube.axial2)

    @property
    def i2_rate(self) -> Tensor:
        # B_rr r² does not depend on u, so that product leaves only the axial part.
        return torch.reciprocal(self.tube.radial) - self.thinning * self.tube.axial2

    @property
    def i4(self) -> Tensor:
        return self.r2 * self.tube.fiber_hoop2 + self.tube.fiber_axial2

    @property
    def i4_rate(self) -> Tensor:
        return self.tube.fiber_hoop2

    def rate(self, name: str) -> Tensor:
        """∂I/∂u of the invariant called name: (Q, N) 1/m²."""
        return getattr(self, f"{name}_rate")

    def curvature(self, name: str) -> Tensor:
        """∂²I/∂u² for I₁ and I₂ (I₄ is linear in u): (Q, N) 1/m⁴."""
        curvature = 2 * self.thinning * self.inverse_r2
        return curvature if name == "i1" else curvature * self.tube.axial2
