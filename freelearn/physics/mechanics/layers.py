"""The wall of a tube at the radii of a quadrature, and what the deformation is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np
import torch
from torch import Tensor, addcmul

from freelearn.common.some_rows import InRows
from freelearn.physics.mechanics.tube import Tube

# The integrands are smooth: six points reach 1e-9 of the load range over the paper's samples and protocol
# (tests/mechanics measures it).
QUADRATURE_POINTS = 6


@lru_cache
def _gauss_legendre(points: int, device: torch.device, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """Nodes and weights on [−1, 1], each (Q, 1)."""
    nodes, weights = np.polynomial.legendre.leggauss(points)

    def column(values: np.ndarray) -> Tensor:
        return torch.as_tensor(values, dtype=dtype, device=device)[:, None]

    return column(nodes), column(weights)


@dataclass(frozen=True)
class Layers(InRows):
    """A tube's wall at Q radii. (Q, N) tensors unless said otherwise.

    weight: twice the quadrature weight times a = R/√λz, so that 2 ∫ f r dr = Σ weight f [m²]; offset: (R² − R_i²)/λz
    [m²]; radial: (R/λz)² [m²]; hoop: 1/R² + k² [1/m²]; fiber_hoop: g [1/m] and fiber_hoop2 its square. (N,): axial λz,
    axial2 λz², twist_rate k [1/m], fiber_axial λz cos Γ and its square fiber_axial2.
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

    @classmethod
    def from_tube(cls, tube: Tube) -> Layers:
        """The layers at the tube's quadrature points."""
        nodes, weights = _gauss_legendre(tube.points or QUADRATURE_POINTS, tube.axial.device, tube.axial.dtype)
        half = (tube.outer - tube.inner) / 2
        radius = tube.inner + half * (1 + nodes)
        return cls._at(tube, radius, (2 * weights) * half * radius)

    @classmethod
    def bore(cls, tube: Tube) -> Layers:
        """The bore alone, Q = 1: weight 2 R_i/λz [m], so that energies per area of the bore at rest [N/m] add up."""
        return cls._at(tube, tube.inner[None], (2 * tube.inner * torch.rsqrt(tube.axial))[None])

    @classmethod
    def _at(cls, tube: Tube, radius: Tensor, weight: Tensor) -> Layers:
        """The layers at radii a = R/√λz, (Q, N) m."""
        axial = tube.axial
        inverse, squared = torch.reciprocal(radius), radius * radius
        axial2 = axial * axial
        fiber_axial = axial * tube.cosine
        fiber_hoop = addcmul(tube.fiber_turn, tube.sine, inverse)
        return cls(
            # A family of fibers that some rows lack: what it carries has a share in them.
            weight=weight if tube.share is None else weight * tube.share,
            offset=squared - tube.unloaded_u,
            radial=squared / axial,
            hoop=addcmul(tube.twist_rate * tube.twist_rate, inverse * inverse, torch.reciprocal(axial)),
            fiber_hoop=fiber_hoop,
            fiber_hoop2=fiber_hoop * fiber_hoop,
            axial=axial,
            axial2=axial2,
            twist_rate=tube.twist_rate,
            fiber_axial=fiber_axial,
            fiber_axial2=fiber_axial * fiber_axial,
        )

    def detach(self) -> Layers:
        """The same layers, cut from every derivative."""
        return Layers(**{f.name: getattr(self, f.name).detach() for f in fields(self)})


class Deformation:
    """Layers inflated to inner radius √u: components of B = F Fᵀ and the invariants, (Q, N), each made once.

    B_rr = (R/λz)²/r², B_θθ = r² (1/R² + k²), B_θz = r k λz, B_zz = λz²;
    I₁ = tr B, I₂ = tr B⁻¹ (det B = 1), I₄ = r² g² + λz² cos² Γ, the fiber's squared stretch.
    A `*_rate` is the derivative with respect to u, which is the derivative with respect to r² at fixed R.
    """

    def __init__(self, layers: Layers, u: Tensor) -> None:
        self.layers = layers
        self.r2 = u + layers.offset
        self.inverse_r2 = torch.reciprocal(self.r2)
        self.b_rr = layers.radial * self.inverse_r2

    @cached_property
    def thinning(self) -> Tensor:
        """B_rr/r² = −∂B_rr/∂u."""
        return self.b_rr * self.inverse_r2

    @cached_property
    def b_thetatheta(self) -> Tensor:
        """r² (1/R² + k²)."""
        return self.r2 * self.layers.hoop

    @property
    def i1(self) -> Tensor:
        """tr B."""
        return self.b_rr + self.b_thetatheta + self.layers.axial2

    @property
    def i1_rate(self) -> Tensor:
        """∂I₁/∂u [1/m²]."""
        return self.layers.hoop - self.thinning

    @property
    def i2(self) -> Tensor:
        """tr B⁻¹."""
        # B is block diagonal (rr | θθ, θz, zz) with det B = 1, so its principal minors sum to this.
        return torch.reciprocal(self.b_rr) + self.b_rr * (self.b_thetatheta + self.layers.axial2)

    @property
    def i2_rate(self) -> Tensor:
        """∂I₂/∂u [1/m²]."""
        # B_rr r² does not depend on u, so that product leaves only the axial part.
        return torch.reciprocal(self.layers.radial) - self.thinning * self.layers.axial2

    @property
    def i4(self) -> Tensor:
        """The fiber's squared stretch."""
        return self.r2 * self.layers.fiber_hoop2 + self.layers.fiber_axial2

    @property
    def i4_rate(self) -> Tensor:
        """∂I₄/∂u [1/m²]."""
        return self.layers.fiber_hoop2

    def invariants(self, names: Sequence[str]) -> tuple[Tensor, ...]:
        """The invariants called names, each (Q, N)."""
        return tuple(getattr(self, name) for name in names)

    def rate(self, name: str) -> Tensor:
        """∂I/∂u of the invariant called name: (Q, N) 1/m²."""
        rate: Tensor = getattr(self, f"{name}_rate")
        return rate

    def curvature(self, name: str) -> Tensor:
        """∂²I/∂u² for I₁ and I₂ (I₄ is linear in u): (Q, N) 1/m⁴."""
        curvature = 2 * self.thinning * self.inverse_r2
        return curvature if name == "i1" else curvature * self.layers.axial2
