"""A mount that gives way in twist."""

from types import SimpleNamespace

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class TwistCompliance(Effect):
    """φ = φ read + c M: the mount turns in the direction in which the actuator's moment drives it."""

    name = "twist_compliance"
    suspect = "The actuator seems too soft in twist where the moment is large: shaft, coupling or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameters = (Parameter("compliance", "c_φ", "rad/(N·m)", start=1e-2, lower=0.0, upper=20.0, none=0.0, scale=0.3),)
    load_dependent = True

    def impose(self, states: States, p: SimpleNamespace, loads: Tensor) -> States:  # type: ignore[override]
        return states.replace(twist=states.twist + p.compliance * loads[..., 1])
