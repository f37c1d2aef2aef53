"""Strands of finite width: a braid that is pulled or turned until they touch locks before its geometric limit."""

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EndEffect, columns
from freelearn.physics.mechanics.inextensible import helix

# A tube does not become thinner than this share of its radius.
THINNEST = 0.1


class Jam(Parameters):
    """stiffness: of the packed strands against being pressed closer, per length of the braid across them. room: share
    of its area at rest that the braid may lose before its strands touch; 1 − room is its coverage at rest."""

    stiffness: Tensor = parameter(
        "s",
        "N/m",
        start=100.0,
        lower=0.0,
        upper=1e6,
        none=0.0,
        scale=2e3,
        prior=Prior(0.0, 1e4, "polymer strands some 0.2 mm thick, packed: 50 MPa"),
    )
    room: Tensor = parameter(
        "ρ",
        "1",
        start=0.05,
        lower=0.0,
        upper=0.9,
        scale=0.05,
        prior=Prior(0.1, 0.1, "braided sleeves cover 75 to 100 %: Davis & Caldwell (2006)"),
    )


class StrandJamming(EndEffect[Jam]):
    """τ shown = τ − ∂U/∂q, U = π R_o L s max((1 − ρ)/a − 1, 0)², a = r l/(R_o L): strands touch where a < 1 − ρ.

    n strands of one family lie 2π r cos α/n apart, cos α = l/B, so that the braid's area 2π r l tells how close they
    are, whatever the twist: a = sin 2α/sin 2Γ in a braid without twist, least where it is pulled long or has swollen
    past 45°. r is that of inextensible fibers. A stop that gives way: the larger s, the harder. The fibers of a wall
    of rubber lie far apart; a search asks it of braids alone.
    """

    name = "strand_jamming"
    place = 6
    suspect = "A braid locks: beyond some stretch, twist or swelling the loads rise steeply, whatever the pressure."
    source = "Davis & Caldwell (2006), strands of pneumatic muscles touch; Chou & Hannaford (1996), finite thickness"
    parameter_class = Jam
    # Few braids are made so close, and are pulled so far.
    odds = 0.02

    def dissipate(self, loads: Tensor, states: States, p: Jam) -> Tensor:
        """As EndEffect.dissipate."""
        fibers, rest = helix(states), states.outer_radius * states.reference_length
        radius2 = torch.maximum(fibers.radius2, (THINNEST * states.outer_radius) ** 2)
        area = radius2.sqrt() * states.length / rest
        closed = torch.clamp((1 - p.room) / area - 1, min=0.0)
        # −∂U/∂(a²), times l/(R_o L)²: what r² l, and the length itself, push with.
        push = math.pi * p.stiffness * closed * (1 - p.room) / area**3 * states.length / rest
        return loads + columns(push * (fibers.by_length + radius2), push * fibers.by_twist)


def area_of(states: States) -> Tensor:
    """a of every row, (N,): the braid's area over that at rest."""
    radius = helix(states).radius2.clamp_min(0.0).sqrt()
    return radius * states.length / (states.outer_radius * states.reference_length)
