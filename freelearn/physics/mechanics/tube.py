"""Kinematics of a thick-walled tube that is stretched, twisted and inflated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import torch
from torch import Tensor

from freelearn.data.states import States

T = TypeVar("T")
# Powers of the radius that are integrated through the wall.
LEAST, MOST = -3, 5


@dataclass(frozen=True)
class Tube:
    """N deformed tubes: everything that does not depend on their inner radius, all (N,).

    axial: stretch λz = l/L; inner, outer: R_i/√λz, R_o/√λz [m], the radii that the stretch alone would leave;
    twist_rate: k = φ/L [1/m]; sine: sin Γ/√λz; cosine: cos Γ of the fiber angle Γ.

    The wall is followed by the radius a = R/√λz of its points, which does not depend on the pressure, so that the
    integration limits are fixed. Incompressibility gives the current radius, r² = x + a² with x = u − R_i²/λz, from
    the one unknown u = r_i² [m²], and r dr = a da. The fiber's circumferential stretch is r g with
    g = sin Γ/R + k cos Γ, its axial one λz cos Γ.

    share: of the family of fibers at the angle Γ, a factor (N,) of what it carries; None for one. second: the same
    tubes with the second family's angle, where some have one.

    points: of the quadrature through the wall; None takes the exact integrals wherever an energy has them.
    """

    axial: Tensor
    inner: Tensor
    outer: Tensor
    twist_rate: Tensor
    sine: Tensor
    cosine: Tensor
    points: int | None = None
    share: Tensor | None = None
    second: Tube | None = None

    @classmethod
    def from_states(cls, states: States, points: int | None = None) -> Tube:
        """The tubes of N states, made once where these are the same in every evaluation (States.near)."""
        if states.near is None:
            return cls._made_of(states, points)
        shape = (states.length, states.twist, states.reference_length, states.inner_radius, states.outer_radius)
        fibers = (states.fiber_angle, states.second_angle, states.second_share)
        return states.near.once(f"tube {points}", (*shape, *fibers), lambda: cls._made_of(states, points))

    @classmethod
    def _made_of(cls, states: States, points: int | None) -> Tube:
        axial = states.length / states.reference_length
        thinner = torch.rsqrt(axial)
        first = cls(
            axial=axial,
            inner=states.inner_radius * thinner,
            outer=states.outer_radius * thinner,
            twist_rate=states.twist / states.reference_length,
            sine=torch.sin(states.fiber_angle) * thinner,
            cosine=torch.cos(states.fiber_angle),
            points=points,
        )
        if states.second_angle is None:
            return first
        sine, cosine = torch.sin(states.second_angle) * thinner, torch.cos(states.second_angle)
        second = replace(first, sine=sine, cosine=cosine, share=states.second_share)
        return replace(first, second=second)

    @cached_property
    def _made(self) -> dict[Any, Any]:
        return {}

    def once(self, make: Callable[[Tube], T]) -> T:
        """What is made of these tubes alone, made once."""
        if make not in self._made:
            self._made[make] = make(self)
        made: T = self._made[make]
        return made

    @property
    def families(self) -> list[Tube]:
        """The same tubes for each family of fibers."""
        return [self] if self.second is None else [self, self.second]

    @cached_property
    def fiber_turn(self) -> Tensor:
        """k cos Γ, (N,) 1/m."""
        return self.twist_rate * self.cosine

    @cached_property
    def unloaded_u(self) -> Tensor:
        """R_i²/λz, the u of a tube without pressure or twist, (N,) m²."""
        return self.inner * self.inner

    @cached_property
    def solid(self) -> Tensor:
        """(R_o² − R_i²)/λz = r_o² − r_i², (N,) m²."""
        return 2.0 * self.integral(1)

    @cached_property
    def integrals(self) -> Tensor:
        """∫ aⁿ da over the wall, for n from LEAST to MOST, (9, N)."""
        a = torch.stack([self.inner, self.outer])
        inverse, a2 = torch.reciprocal(a), a * a
        a3, a4 = a2 * a, a2 * a2
        raised = torch.stack([inverse * inverse, inverse, torch.log(a), a, a2, a3, a4, a4 * a, a3 * a3])
        # What is raised to n + 1 is so many times too large; a logarithm is not.
        times = a.new_tensor([1 / (n + 1 or 1) for n in range(LEAST, MOST + 1)])
        return times.reshape(-1, *(1,) * self.inner.ndim) * (raised[:, 1] - raised[:, 0])

    def integral(self, n: int) -> Tensor:
        """∫ aⁿ da over the wall, (N,)."""
        return self._rows[n - LEAST]

    @cached_property
    def _rows(self) -> tuple[Tensor, ...]:
        return self.integrals.unbind()
