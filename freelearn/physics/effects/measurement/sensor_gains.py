"""Force and moment sensors with a wrong sensitivity."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class ForceSensitivity(Parameters):
    """gain: relative error of the cell."""

    gain: Tensor = parameter(
        "g_F",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        prior=Prior(0.0, 0.05, "load cells' data sheets: span, and cells mounted askew"),
    )


class ForceGain(MeasurementEffect[ForceSensitivity]):
    """F shown = (1 + g) F."""

    name = "force_gain"
    place = 3
    suspect = "All forces are off by the same share, and the moments are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = ForceSensitivity

    def sense(self, loads: Tensor, states: States, p: ForceSensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(1 + p.gain, torch.ones_like(p.gain))


class MomentSensitivity(Parameters):
    """gain: relative error of the cell."""

    gain: Tensor = parameter(
        "g_M",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        prior=Prior(0.0, 0.05, "torque cells' data sheets: span, and cells mounted askew"),
    )


class MomentGain(MeasurementEffect[MomentSensitivity]):
    """M shown = (1 + g) M."""

    name = "moment_gain"
    place = 4
    suspect = "All moments are off by the same share, and the forces are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = MomentSensitivity
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: MomentSensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(torch.ones_like(p.gain), 1 + p.gain)
