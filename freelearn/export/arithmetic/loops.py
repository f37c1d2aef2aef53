"""Loops that run a fixed number of times, as a trace sees them, and how hard a state works the wall."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from freelearn.data.states import HOOP_ITERATIONS, LEAST_HOOP, MOST_HOOP, SHEAR_MODULUS, STIFFER, States

_LIBRARY = torch.library.Library("freelearn_export", "DEF")
_LIBRARY.define("begin(Tensor[] start) -> Tensor[]")
_LIBRARY.define("end(Tensor[] carried, Tensor[] next, int times) -> Tensor[]")


def _begin(start: Sequence[Tensor]) -> list[Tensor]:
    return [t.clone() for t in start]


def _end(carried: Sequence[Tensor], next: Sequence[Tensor], times: int) -> list[Tensor]:
    return [t.clone() for t in next]


_LIBRARY.impl("begin", _begin, "CompositeExplicitAutograd")
_LIBRARY.impl("end", _end, "CompositeExplicitAutograd")
BEGIN, END = torch.ops.freelearn_export.begin.default, torch.ops.freelearn_export.end.default


def repeated(
    turn: Callable[[list[Tensor]], Sequence[Tensor]], start: Sequence[Tensor], times: int
) -> list[Tensor]:  # fmt: skip
    """What start becomes after so many turns: inside of a trace, where one turn stands for all.

    turn: from what is carried to what it becomes, tensors of the same shapes."""
    carried = BEGIN([t.detach() for t in start])
    following = [n.expand_as(c) for n, c in zip(turn(list(carried)), carried, strict=True)]
    ended: list[Tensor] = END(carried, following, times)
    return ended


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
