"""Samples measured one after another by a cell whose sensitivity was not the same for all."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class OwnSensitivity(Parameters):
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


class OwnForceGain(MeasurementEffect[OwnSensitivity]):
    """F shown of sample i = (1 + gᵢ) F; of the first g is 0, and what all share is `force_gain`.

    A cell that was calibrated, mounted or amplified anew between samples.
    """

    name = "own_force_gain"
    place = 5
    compares = True
    suspect = "All forces of one sample are off by the same share, and its moments are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = OwnSensitivity

    def sense(self, loads: Tensor, states: States, p: OwnSensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(1 + p.gain, torch.ones_like(p.gain))


class OwnMomentGain(MeasurementEffect[OwnSensitivity]):
    """M shown of sample i = (1 + gᵢ) M, as own_force_gain."""

    name = "own_moment_gain"
    place = 6
    compares = True
    suspect = "All moments of one sample are off by the same share, and its forces are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = OwnSensitivity
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: OwnSensitivity) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(torch.ones_like(p.gain), 1 + p.gain)
