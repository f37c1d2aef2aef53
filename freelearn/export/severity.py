"""How hard a state works the wall, in torch: the same number that measurements.states.severity gives of a table."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.export.loops import repeated
from freelearn.measurements.states import HOOP_ITERATIONS, LEAST_HOOP, MOST_HOOP, SHEAR_MODULUS, STIFFER, States


def severity(states: States, elongation: Tensor, twist: Tensor, pressure: Tensor) -> Tensor:
    """Severity (1,) of one row's actuator at an elongation [m], a twist [rad] and a pressure [Pa], each (1,)."""
    length, inner, outer = states.reference_length, states.inner_radius, states.outer_radius
    radius = (inner + outer) / 2
    axial = (1 + elongation / length) ** 2
    shear = radius * twist / length
    families: list[tuple[Tensor, Tensor | float]] = [(states.fiber_angle, STIFFER)]
    if states.second_angle is not None and states.second_share is not None:
        families.append((states.second_angle, STIFFER * states.second_share))
    along = [axial * torch.cos(angle) ** 2 for angle, _ in families]
    across = [(torch.sin(angle) + shear * torch.cos(angle)) ** 2 for angle, _ in families]
    weights = [weight for _, weight in families]
    push = pressure * radius * axial**0.5 / (outer - inner) / SHEAR_MODULUS

    def turn(carried: list[Tensor]) -> list[Tensor]:
        (hoop,) = carried
        slope, steeper = -1 / (axial * hoop**2) + 1 + shear**2 - push, 2 / (axial * hoop**3)
        for weight, lengthwise, crosswise in zip(weights, along, across, strict=True):
            slope = slope + 2 * weight * crosswise * (hoop * crosswise + lengthwise - 1)
            steeper = steeper + 2 * weight * crosswise**2
        return [(hoop - slope / steeper).clamp(LEAST_HOOP, MOST_HOOP)]

    (hoop,) = repeated(turn, [torch.full_like(twist, LEAST_HOOP)], HOOP_ITERATIONS)
    stored = 1 / (axial * hoop) + (1 + shear**2) * hoop + axial - 3
    for weight, lengthwise, crosswise in zip(weights, along, across, strict=True):
        stored = stored + weight * (hoop * crosswise + lengthwise - 1) ** 2
    return stored
