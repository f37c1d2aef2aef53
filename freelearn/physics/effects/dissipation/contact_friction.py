"""Threads that rub on each other and on the bladder: friction that grows with the pressure between them."""

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import DissipationEffect, columns
from freelearn.physics.mechanics.inextensible import helix

# A tube does not become thinner than this share of its radius.
THINNEST = 0.1


class Contact(Parameters):
    """force, moment: friction over what the pressure presses on the tube's surface, and that times its radius."""

    force: Tensor = parameter(
        "f",
        "1",
        start=0.0,
        none=0.0,
        scale=2e-3,
        per_sample=True,
        prior=Prior(0.0, 0.01, "Tondu & Lopez (2000); Davis & Caldwell (2006)"),
    )
    moment: Tensor = parameter(
        "g",
        "1",
        start=0.0,
        none=0.0,
        scale=2e-3,
        per_sample=True,
        prior=Prior(0.0, 0.01, "as its force: Tondu & Lopez (2000)"),
    )


class ContactFriction(DissipationEffect[Contact]):
    """F and M lag by f P S and g P S r against the direction in which the pressure changed, S = 2π r l.

    r is that of inextensible fibers at this length and twist, S the surface on which the threads are pressed together.
    Both are signed, and each sample rubs on its own, as in friction_hysteresis; without pressure nothing rubs. A braid
    without twist makes no moment.
    """

    name = "contact_friction"
    directed = True
    place = 1
    suspect = "Loads differ between inflating and deflating, and the more the higher the pressure."
    source = "Tondu & Lopez (2000), F = f S P; Chou & Hannaford (1996); Davis & Caldwell (2006)"
    parameter_class = Contact
    loose = 0.01

    def dissipate(self, loads: Tensor, states: States, p: Contact) -> Tensor:
        """As DissipationEffect.dissipate."""
        least = (THINNEST * states.outer_radius) ** 2
        radius = torch.maximum(helix(states).radius2, least).sqrt()
        pressed = states.direction * states.pressure * 2 * math.pi * radius * states.length
        return loads - columns(pressed * p.force, pressed * radius * p.moment)
