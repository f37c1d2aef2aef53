"""A wall thicker or thinner than the drawing says."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class WallThickness(Effect):
    """R_o built = R_o + ΔR_o; the bore R_i is the mandrel's and stays."""

    name = "wall_thickness"
    suspect = "One sample is too stiff or too soft everywhere; the rubber coat was cast or dipped by hand."
    source = "thick-walled tubes: Ogden (1997)"
    models = ("continuum", "linear")
    parameters = (
        Parameter(
            "outer_radius", "ΔR_o", "m", start=0.0, lower=-1e-3, upper=3e-3, none=0.0, per_sample=True, scale=1e-4
        ),
    )

    def reshape(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(outer_radius=states.outer_radius + p.outer_radius)
