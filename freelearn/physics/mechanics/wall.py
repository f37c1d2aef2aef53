"""What the wall of a tube carries at a given inner radius, energy by energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from torch import Tensor


class Carried(NamedTuple):
    """pressure: P = ∫ (σθθ − σrr)/r dr [Pa]; slope: dP/du [Pa/m²], u = r_i². Both (N,)."""

    pressure: Tensor
    slope: Tensor


class Expansion(NamedTuple):
    """The pressure carried at u (1 + δ) to second order, P + rise δ + bend δ²/2: P, u dP/du, u² d²P/du² [Pa], (N,)."""

    pressure: Tensor
    rise: Tensor
    bend: Tensor


class Resultants(NamedTuple):
    """tension: ∫ (2σzz − σrr − σθθ) r dr [N]; shear: ∫ σθz r² dr [N·m]. Both (N,); see loads.tube_loads."""

    tension: Tensor
    shear: Tensor


class Wall(Protocol):
    """An energy in the wall of N tubes, as a function of u = r_i² (N,) m²."""

    @property
    def stiffens(self) -> bool:
        """Whether the pressure carried is known to rise with u everywhere; only then is there an expansion."""

    def carried(self, u: Tensor) -> Carried:
        """The pressure that the stresses balance, and how it grows with u."""

    def expansion(self, u: Tensor) -> Expansion:
        """The pressure to second order."""

    def resultants(self, u: Tensor) -> Resultants:
        """The stresses' axial and twisting resultants."""

    def detach(self) -> Wall:
        """The same wall, cut from every derivative."""

    def some(self, rows: Tensor, count: int) -> Wall:
        """The walls of some of so many tubes; rows: (n,) int64."""


class WallSum:
    """Several energies in one wall."""

    def __init__(self, parts: Sequence[Wall]) -> None:
        self.parts = parts

    def carried(self, u: Tensor) -> Carried:
        """The sum of what the parts carry."""
        total, *others = (part.carried(u) for part in self.parts)
        for other in others:
            total = Carried(total.pressure + other.pressure, total.slope + other.slope)
        return total

    @property
    def stiffens(self) -> bool:
        """Whether all parts do."""
        return all(part.stiffens for part in self.parts)

    def expansion(self, u: Tensor) -> Expansion:
        """The sum of the parts' expansions."""
        total, *others = (part.expansion(u) for part in self.parts)
        for other in others:
            total = Expansion(total.pressure + other.pressure, total.rise + other.rise, total.bend + other.bend)
        return total

    def resultants(self, u: Tensor) -> Resultants:
        """The sum of the parts' resultants."""
        total, *others = (part.resultants(u) for part in self.parts)
        for other in others:
            total = Resultants(total.tension + other.tension, total.shear + other.shear)
        return total

    def detach(self) -> WallSum:
        """The same wall, cut from every derivative."""
        return WallSum([part.detach() for part in self.parts])

    def some(self, rows: Tensor, count: int) -> WallSum:
        """The walls of some of so many tubes."""
        return WallSum([part.some(rows, count) for part in self.parts])
