"""How the loads of a tube in equilibrium answer to the moduli of its wall, in closed form."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from freelearn.mechanics.closed_form import FiberWall, NeoHookeanWall
from freelearn.mechanics.equilibrium import Inflated
from freelearn.mechanics.wall import WallSum


def modulus_rates(inflated: Inflated) -> Tensor | None:
    """∂loads/∂ln C of every energy's modulus C: (N, 2, terms) N, N·m; None for a wall without closed form.

    Each term's stresses are proportional to its modulus, so at fixed u a rate in ln C is the term's own part of the
    pressure and of the loads, and u gives way by du = −P_term/(dP/du) (implicit function theorem). A row without
    equilibrium stays at the bound and counts the thrust of the pressure that it does not carry.
    """
    wall, u, balanced, _ = inflated
    parts = wall.parts if isinstance(wall, WallSum) else [wall]
    closed = [part for part in parts if isinstance(part, NeoHookeanWall | FiberWall)]
    if len(closed) < len(parts):
        return None
    carried = [part.carried(u) for part in closed]
    slope = torch.stack([c.slope for c in carried]).sum(0)
    rates = [part.rates(u) for part in closed]
    tension, shear = (torch.stack(r).sum(0) for r in zip(*rates, strict=True))
    columns = []
    for part, (pressure, _) in zip(closed, carried, strict=True):
        own = part.resultants(u)
        give = torch.where(balanced, -pressure / slope, 0.0)
        thrust = torch.where(balanced, 0.0, u * pressure)
        columns += [-math.pi * (own.tension + give * tension + thrust), -2 * math.pi * (own.shear + give * shear)]
    return torch.stack(columns, dim=-1).reshape(len(u), len(closed), 2).mT
