"""Force and moment sensors with a wrong sensitivity, the same for all samples or not."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class Sensitivity(Parameters):
    """gain: relative error of the cell."""

    gain: Tensor = parameter(
        "g_F",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        prior=Prior(0.0, 0.05, "load and torque cells' data sheets: span, and cells mounted askew"),
    )


class ForceGain(MeasurementEffect[Sensitivity]):
    """F shown = (1 + g) F."""

    name = "force_gain"
    place = 3
    suspect = "All forces are off by the same share, and the moments are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Sensitivity

    def sense(self, loads: Tensor, states: States, p: Sensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(1 + p.gain, torch.ones_like(p.gain))


class MomentGain(MeasurementEffect[Sensitivity]):
    """M shown = (1 + g) M."""

    name = "moment_gain"
    place = 4
    suspect = "All moments are off by the same share, and the forces are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Sensitivity
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: Sensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(torch.ones_like(p.gain), 1 + p.gain)


class OwnSensitivity(Sensitivity):
    """gain: of a sample's readings against the first one's; 0.1 is one whose loads are shown 10 % larger."""

    gain: Tensor = parameter(
        "g",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        per_sample=True,
        # Each of the two 5 %, as a gain that all share; that of the first is in all ratios.
        prior=Prior(0.0, 0.07, "load cells' data sheets: span, each time it is set", common=0.5),
    )


class OwnForceGain(ForceGain):
    """F shown of sample i = (1 + gᵢ) F; of the first g is 0, and what all share is `force_gain`.

    A cell that was calibrated, mounted or amplified anew between samples.
    """

    name = "own_force_gain"
    place = 5
    compares = True
    suspect = "All forces of one sample are off by the same share, and its moments are right."
    parameter_class = OwnSensitivity
    # A cell is seldom calibrated between the samples of one session: more often it is off for all of them.
    odds = 0.02


class OwnMomentGain(MomentGain):
    """M shown of sample i = (1 + gᵢ) M, as own_force_gain."""

    name = "own_moment_gain"
    place = 6
    compares = True
    suspect = "All moments of one sample are off by the same share, and its forces are right."
    parameter_class = OwnSensitivity
    odds = 0.02
