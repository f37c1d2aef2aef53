"""The material of the continuum model."""

from __future__ import annotations

from torch import Tensor

from freelearn.models.parameters import Parameters, parameter


class Material(Parameters):
    """C1: shear modulus of the wall [Pa]; C2: stiffness of the fiber per wall volume [Pa]; both fitted as logs."""

    C1: Tensor = parameter("C₁", "Pa", start=1e5, lower=0.0, log=True, source="Sedal et al. 2018")
    C2: Tensor = parameter("C₂", "Pa", start=1e6, lower=0.0, log=True, source="Sedal et al. 2018")
