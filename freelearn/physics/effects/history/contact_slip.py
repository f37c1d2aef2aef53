"""Threads that the pressure presses together: they stick the harder, the higher it is, and slip one after the other."""

import math

import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import held
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect
from freelearn.physics.mechanics.inextensible import helix

# A tube does not become thinner than this share of its radius.
THINNEST = 0.1


class Pressed(Parameters):
    """share: of a load's change that is held back at first after a turn; force, moment: friction over what the pressure
    presses on the tube's surface, and that times its radius."""

    share: Tensor = parameter(
        "s",
        "1",
        start=0.2,
        lower=0.0,
        upper=1.0,
        none=0.0,
        scale=0.3,
        prior=Prior(0.0, 0.7, "between none and all: Al-Bender et al. (2005)"),
    )
    force: Tensor = parameter(
        "f",
        "1",
        start=5e-3,
        lower=1e-6,
        upper=1.0,
        log=True,
        scale=5e-3,
        prior=Prior(5e-3, 1.5, "Tondu & Lopez (2000); Davis & Caldwell (2006)"),
    )
    moment: Tensor = parameter(
        "g",
        "1",
        start=5e-3,
        lower=1e-6,
        upper=1.0,
        log=True,
        scale=5e-3,
        prior=Prior(5e-3, 1.5, "as its force: Tondu & Lopez (2000)"),
    )


class ContactSlip(HistoryEffect[Pressed]):
    """As maxwell_slip, with thresholds f P S and g P S r: S = 2π r l is the surface on which threads are pressed.

    r is that of inextensible fibers at this length and twist, as in contact_friction; without pressure nothing sticks.
    """

    name = "contact_slip"
    place = 2
    suspect = "Loops of load against pressure that turn gently at the ends and are the wider, the higher the pressure."
    source = "Tondu & Lopez (2000), F = f S P; Al-Bender, Lampaert & Swevers (2005)"
    beds = ("kinematic", "isometric")
    parameter_class = Pressed
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Pressed) -> Tensor:
        """As HistoryEffect.carry."""
        threshold = _pressed(recording.states) * torch.stack([p.force, p.moment])
        return signal - p.share * held(signal, recording, -threshold, threshold)


def _pressed(states: States) -> Tensor:
    """P S and P S r of every sample, (M, 2) N, N·m: never less than nothing."""
    least = (THINNEST * states.outer_radius) ** 2
    radius = torch.maximum(helix(states).radius2, least).sqrt()
    force = states.pressure.clamp_min(0.0) * 2 * math.pi * radius * states.length
    return torch.stack([force, force * radius], dim=-1)
