"""A braided (McKibben) muscle by virtual work, as docs/own_model.md shows it."""

import torch
from torch import Tensor

from freelearn.own import Model, Parameters, States, columns, parameter


class Braid(Parameters):
    k: Tensor = parameter("k", "N/m", start=1e3, lower=0.0, log=True)
    k_t: Tensor = parameter("k_t", "N·m/rad", start=0.1, lower=0.0, log=True)


class BraidedMuscle(Model[Braid]):
    """F = P dV/dl − k (l − L) of an inextensible braid, M = −k_t φ (Chou & Hannaford 1996; Tondu & Lopez 2000)."""

    name = "braided"
    parameter_class = Braid
    conservative = relaxed_at_rest = True

    def structure(self, states: States, p: Braid) -> Tensor:
        a, b = 3 / torch.tan(states.fiber_angle) ** 2, 1 / torch.sin(states.fiber_angle) ** 2
        stretch = states.length / states.reference_length
        # Threads nearer to the axis than 54.7° make it pull (F < 0), others make it push.
        fluid = torch.pi * states.outer_radius**2 * states.pressure * (b - a * stretch**2)
        return columns(fluid - p.k * (states.length - states.reference_length), -p.k_t * states.twist)
