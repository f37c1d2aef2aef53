"""Force and moment sensors that are not zero at rest."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class ForceZero(Parameters):
    """force: shown minus real."""

    force: Tensor = parameter(
        "F₀",
        "N",
        start=0.0,
        lower=-1e3,
        upper=1e3,
        none=0.0,
        per_sample=True,
        scale=0.5,
        prior=Prior(0.0, 0.05, "load cells' data sheets: zero balance", of="force", common=0.5),
    )


class ForceOffset(MeasurementEffect[ForceZero]):
    """F shown = F + F₀. A cell is set to zero anew when a sample is mounted, so each has its own."""

    name = "force_offset"
    place = 1
    suspect = "All forces of a sample are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = ForceZero

    def sense(self, loads: Tensor, states: States, p: ForceZero) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads + columns(p.force, torch.zeros_like(p.force))


class MomentZero(Parameters):
    """moment: shown minus real."""

    moment: Tensor = parameter(
        "M₀",
        "N·m",
        start=0.0,
        lower=-10.0,
        upper=10.0,
        none=0.0,
        per_sample=True,
        scale=5e-3,
        prior=Prior(0.0, 0.05, "torque cells' data sheets: zero balance", of="moment", common=0.5),
    )


class MomentOffset(MeasurementEffect[MomentZero]):
    """M shown = M + M₀, of each sample its own."""

    name = "moment_offset"
    place = 2
    suspect = "All moments of a sample are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = MomentZero
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: MomentZero) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads + columns(torch.zeros_like(p.moment), p.moment)
