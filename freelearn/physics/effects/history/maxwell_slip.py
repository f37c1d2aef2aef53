"""Threads and fabric that stick and slip one after the other: a load that lags by a distribution of friction."""

import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import held
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect

KNOWN = Prior(0.05, 1.5, "Tondu & Lopez (2000): 5 % of the largest force", of="force")


class Slip(Parameters):
    """share: of a load's change that is held back at first after a turn; force, moment: changes after which, in the
    mean, an element slips; asymmetry: by how much it slips later downwards than upwards."""

    share: Tensor = parameter(
        "s",
        "1",
        start=0.1,
        lower=0.0,
        upper=1.0,
        none=0.0,
        scale=0.2,
        prior=Prior(0.0, 0.5, "between none and all: Al-Bender et al. (2005)"),
    )
    force: Tensor = parameter("r_F", "N", start=5.0, lower=1e-4, upper=1e5, log=True, scale=5.0, prior=KNOWN)
    moment: Tensor = parameter(
        "r_M",
        "N·m",
        start=0.02,
        lower=1e-7,
        upper=1e3,
        log=True,
        scale=0.02,
        prior=Prior(0.05, 1.5, "as its force: Tondu & Lopez (2000)", of="moment"),
    )
    asymmetry: Tensor = parameter(
        "a",
        "1",
        start=0.0,
        lower=-0.9,
        upper=0.9,
        none=0.0,
        scale=0.3,
        prior=Prior(0.0, 0.3, "muscles differ by branch: Vo-Minh et al. (2011)"),
    )


class MaxwellSlip(HistoryEffect[Slip]):
    """F shown = F − s Σ wᵢ stopᵢ(F): elements stick until F has changed by their threshold, and then slip along.

    Thresholds are spread exponentially about r (1 − a) upwards and r (1 + a) downwards, so that one number tells all.
    It is a generalized Prandtl–Ishlinskii operator: its loop has the size s r and does not depend on the rate.
    """

    name = "maxwell_slip"
    place = 1
    suspect = "Loops of load against pressure that turn gently at the ends and are as wide at any rate."
    source = "Al-Bender, Lampaert & Swevers (2005); of muscles: Vo-Minh et al. (2011)"
    beds = ("kinematic", "isometric")
    parameter_class = Slip
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Slip) -> Tensor:
        """As HistoryEffect.carry."""
        threshold = torch.stack([p.force, p.moment])
        sticking = held(signal, recording, -threshold * (1 + p.asymmetry), threshold * (1 - p.asymmetry))
        return signal - p.share * sticking
