"""The material of the continuum model."""

from __future__ import annotations

from torch import Tensor

from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter

# Logarithms: what holds pressure is made of silicone of 10 kPa to natural rubber and polyurethane of some MPa, and its
# fiber, spread over the wall, may be a few sewing threads or a braid of aramid.
RUBBER = Prior(2.2e5, 1.25, "silicones (Marechal et al. 2021), latex and TPU: 0.01 to 5 MPa")
FIBERS = Prior(3e7, 2.3, "cotton to aramid thread, 1 to 100 GPa, at 0.1 to 10 % of the wall")


class Material(Parameters):
    """C1: shear modulus of the wall [Pa]; C2: stiffness of the fiber per wall volume [Pa]; both fitted as logs."""

    C1: Tensor = parameter("C₁", "Pa", start=1e5, lower=0.0, log=True, source="Sedal et al. 2018", prior=RUBBER)
    C2: Tensor = parameter("C₂", "Pa", start=1e6, lower=0.0, log=True, source="Sedal et al. 2018", prior=FIBERS)
