"""A wall thicker or thinner than the drawing says."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import GeometryEffect


class Thickness(Parameters):
    """outer_radius: built minus drawn."""

    outer_radius: Tensor = parameter(
        "ΔR_o",
        "m",
        start=0.0,
        lower=-1e-3,
        upper=3e-3,
        none=0.0,
        per_sample=True,
        scale=1e-4,
        prior=Prior(0.0, 3e-4, "extruded and dipped tubes; linear tolerances: ISO 2768"),
    )


class WallThickness(GeometryEffect[Thickness]):
    """R_o built = R_o + ΔR_o; the bore R_i is the mandrel's and stays."""

    name = "wall_thickness"
    place = 2
    suspect = "One sample is too stiff or too soft everywhere; the rubber coat was cast or dipped by hand."
    source = "thick-walled tubes: Ogden (1997)"
    parameter_class = Thickness

    def reshape(self, states: States, p: Thickness) -> States:
        """As GeometryEffect.reshape."""
        return states.replace(outer_radius=states.outer_radius + p.outer_radius)
