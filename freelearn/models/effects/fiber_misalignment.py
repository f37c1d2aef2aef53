"""Fibres wound at another angle than the drawing says."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class FiberMisalignment(Effect):
    """Γ built = Γ + ΔΓ (Bruder et al. 2018 blame fabrication tolerance; the paper's Section on samples)."""

    name = "fiber_misalignment"
    suspect = "One sample is off as if it had a neighbour's fibre angle."
    source = "Bruder et al. (2018), fabrication tolerance"
    models = ("continuum", "linear")
    parameters = (
        Parameter("angle", "ΔΓ", "rad", start=0.0, lower=-0.2, upper=0.2, none=0.0, per_sample=True, scale=0.02),
    )

    def reshape(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(fiber_angle=states.fiber_angle + p.angle)
