"""Ends that taper to their fittings: the swollen tube holds less fluid than a cylinder."""

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EndEffect, columns
from freelearn.physics.mechanics.inextensible import helix

# Swelling, in outer radii, below which the cones vanish faster than in proportion: the loads stay smooth at rest.
SMOOTH = 0.01
# A tube does not become thinner than this share of its radius.
THINNEST = 0.1


class Taper(Parameters):
    """ratio: length of the cone at each end over the swelling r − R_o, the cotangent of its slope."""

    ratio: Tensor = parameter(
        "t",
        "1",
        start=1.0,
        lower=0.0,
        upper=20.0,
        none=0.0,
        scale=3.0,
        prior=Prior(0.0, 2.0, "cones of 27° and steeper: Tondu (2012)"),
    )


class EndTaper(EndEffect[Taper]):
    """τ shown = τ − P ∂V/∂q, V = (2πt/3) (2r + R_o) |r − R_o|(r − R_o): what two cones of length t |r − R_o| lack.

    The fittings keep the radius R_o, and the ends are cones between it and the radius r of inextensible fibers at
    this length and twist, so that the length lost grows with the swelling. By virtual work: exactly reciprocal. What
    the cones change in the wall, and their threads' length, are left out. In a braid the force lost is in proportion to
    the contraction ε at first, as with k > 1 in F = −π R_o² P (a (1 − k ε)² − b).
    """

    name = "end_taper"
    place = 4
    suspect = "The force falls short of that of a cylinder, the more the tube swells: its ends are cones."
    source = "Tondu & Lopez (2000); Tondu (2012), rigid tips of McKibben muscles"
    parameter_class = Taper

    def dissipate(self, loads: Tensor, states: States, p: Taper) -> Tensor:
        """As EndEffect.dissipate."""
        fibers, rest = helix(states), states.outer_radius
        radius = torch.maximum(fibers.radius2, (THINNEST * rest) ** 2).sqrt()
        swelling = radius - rest
        square, small = swelling**2, (SMOOTH * rest) ** 2
        size = (square + small).sqrt()
        # s(x) = x³/√(x² + small) for |x| x, and its slope.
        signed, slope = swelling * square / size, square * (2 * square + 3 * small) / size**3
        by_square = math.pi / 3 * p.ratio * (2 * signed + (2 * radius + rest) * slope) / radius  # ∂V/∂(r²)
        push = states.pressure * by_square / states.length
        return loads - columns(push * (fibers.by_length - fibers.radius2), push * fibers.by_twist)
