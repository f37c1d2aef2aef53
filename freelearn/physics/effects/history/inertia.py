"""An end that swings, or a load cell that rings: what is measured overshoots, and comes to rest after some swings."""

import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import rung
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect

KNOWN = Prior(0.0, 0.3, "masses of 0.1 to 1 kg on muscles of 1 to 10 N/mm: tenths of a second")


class Swing(Parameters):
    """force, moment: periods of the two channels (of elongation and twist, where those are measured). damping: in units
    of the critical one."""

    force: Tensor = parameter("T_F", "s", start=0.1, lower=0.0, upper=60.0, none=0.0, scale=0.3, prior=KNOWN)
    moment: Tensor = parameter("T_M", "s", start=0.1, lower=0.0, upper=60.0, none=0.0, scale=0.3, prior=KNOWN)
    damping: Tensor = parameter(
        "ζ",
        "1",
        start=0.2,
        lower=0.005,
        upper=0.95,
        log=True,
        scale=0.2,
        prior=Prior(0.2, 1.0, "rubber and fabric lose a tenth to a half of a swing: Ferry (1980)"),
    )


class Inertia(HistoryEffect[Swing]):
    """y'' + 2ζω y' + ω² (y − x) = 0, ω = 2π/T, of each channel by itself: x where it would rest, y what is measured.

    An end of mass m on a stiffness k has ω² = k/m, taken for constant. It begins each recording at rest.
    """

    name = "inertia"
    place = 8
    acts_on = "readings"
    suspect = "After a step the reading overshoots and swings, in periods that do not depend on how quick the step was."
    source = "second-order system: Doebelin, Measurement Systems (2003); of a muscle's load: Tondu & Lopez (2000)"
    parameter_class = Swing
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Swing) -> Tensor:
        """As HistoryEffect.carry."""
        return rung(signal, recording, torch.stack([p.force, p.moment]), p.damping)
