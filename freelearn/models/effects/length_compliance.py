"""A mount that gives way along the axis."""

from types import SimpleNamespace

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class LengthCompliance(Effect):
    """l = l read + c F: an actuator that pushes outward (F > 0) lengthens, because the mount yields to it."""

    name = "length_compliance"
    suspect = "The actuator seems too soft in stretch where the force is large: load cell, stage or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameters = (Parameter("compliance", "c_l", "m/N", start=1e-6, lower=0.0, upper=1e-2, none=0.0, scale=2e-5),)
    load_dependent = True

    def impose(self, states: States, p: SimpleNamespace, loads: Tensor) -> States:  # type: ignore[override]
        return states.replace(length=states.length + p.compliance * loads[..., 0])
