"""How rubber relaxes: arms beside its stress at rest, each with a modulus and a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.recordings import Recording
from freelearn.physics.chain.lags import lag
from freelearn.physics.chain.model import Values
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.mechanics.energy import Energy, Tensors

# Most Prony arms: more are told apart by no recording of a few decades of time.
MOST_ARMS = 3
POWER = "power"
# Of a power law: the time at which its modulus is told [s], arms a decade of time, and decades beyond the recordings'.
AT, EACH_DECADE, BEYOND = 1.0, 2, 1.0
FALL = Parameter(
    "fall", "n", "1", start=0.3, lower=0.01, upper=0.99, scale=0.1, source="Chasset & Thirion (1965)"
)  # fmt: skip
SOFTENING = Parameter("softening", "b", "1", start=0.3, lower=1e-4, upper=1e3, log=True, scale=1.0)
# Beyond one half simple shear has a largest stress.
EXPONENT = Parameter("exponent", "e", "1", start=0.2, lower=0.0, upper=0.5, scale=0.1, source="Knowles (1977)")


@dataclass(frozen=True)
class Softened(Energy):
    """∂Ψ/∂I₁ = ½ (1 + b (I₁ − 3))⁻ᵉ: a neo-Hookean solid of modulus 1 Pa that softens as it is strained (Knowles)."""

    softening: Tensor
    exponent: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i1",)

    def gradient(self, *invariants: Tensor) -> Tensors:
        """∂Ψ/∂I₁ [Pa]."""
        return ((1 + self.softening * (invariants[0] - 3)) ** -self.exponent / 2,)


class Relaxation:
    """P = P_e + Σ Gᵢ hᵢ, hᵢ' = Q' − hᵢ/τᵢ, of nominal stresses: Q that of a neo-Hookean solid of modulus 1, softened or
    not; arms thus have a strain energy of their own (Fung 1993; separate networks: Bergström & Boyce 1998).

    Where principal directions turn, as in simple shear, nominal stresses convolve as measured ones do; Simo's (1987)
    deviatoric S, pulled through a C that has long changed, does not.

    kind: the number of arms, 0 to 3, with arm_1.modulus, arm_1.time, …, or POWER, many arms whose moduli fall as a
    power of their times do, so that a step's overstress falls as arms.modulus (t/1 s)⁻ⁿ. softened: with arms.softening
    and arms.exponent. span: shortest and longest time that is told of, s. declared: parameters by name.
    """

    def __init__(self, kind: int | str = 0, softened: bool = False, span: tuple[float, float] = (1e-2, 1e3)) -> None:
        if kind != POWER and kind not in range(MOST_ARMS + 1):
            raise UserError(f"{kind!r} is no relaxation: write 0 … {MOST_ARMS}, a number of arms, or {POWER}.")
        self.kind, self.softened, self.span = kind, softened and kind != 0, span
        self.declared: dict[str, Parameter] = {}
        if kind == POWER:
            self.declared = {"arms.modulus": _modulus(), "arms.fall": FALL}
        else:
            for arm in range(int(kind)):
                middle = span[0] * (span[1] / span[0]) ** ((arm + 0.5) / int(kind))
                self.declared[f"arm_{arm + 1}.modulus"] = _modulus()
                self.declared[f"arm_{arm + 1}.time"] = _time(middle, span)
        if self.softened:
            self.declared |= {"arms.softening": SOFTENING, "arms.exponent": EXPONENT}

    def __bool__(self) -> bool:
        return self.kind != 0

    @property
    def words(self) -> str:
        """What it is called in a table."""
        if not self:
            return "none"
        arms = "power law" if self.kind == POWER else f"{self.kind} arm{'s' if int(self.kind) > 1 else ''}"
        return f"{arms}, softened" if self.softened else arms

    def energy(self, values: Values) -> Energy:
        """Of the arms, for a modulus of 1 Pa."""
        if self.softened:
            return Softened(values["arms.softening"], values["arms.exponent"])
        none = torch.zeros((), dtype=torch.float64)
        return Softened(none, none)

    def arms(self, values: Values) -> tuple[Tensor, Tensor]:
        """Modulus [Pa] and time [s] of each arm, (A,) each."""
        if self.kind != POWER:
            names = [f"arm_{arm + 1}" for arm in range(int(self.kind))]
            return tuple(torch.stack([values[f"{n}.{of}"] for n in names]) for of in ("modulus", "time"))  # type: ignore[return-value]
        modulus, fall = values["arms.modulus"], values["arms.fall"]
        # t⁻ⁿ = ∫ τ⁻ⁿ e^(−t/τ) d ln τ / Γ(n), as a sum over even steps of ln τ.
        low, high = (math.log10(t) + side * BEYOND for t, side in zip(self.span, (-1, 1), strict=True))
        count = math.ceil((high - low) * EACH_DECADE) + 1
        time = 10 ** (low + torch.arange(count, dtype=torch.float64) / EACH_DECADE)
        step = math.log(10) / EACH_DECADE
        return modulus * step * torch.exp(-fall * (time / AT).log() - torch.lgamma(fall)), time

    def overstress(self, values: Values, stress: Tensor, recording: Recording[Tensor]) -> Tensor:
        """Σ Gᵢ hᵢ of the arms' stresses for a modulus of 1, Q (M,), along recordings, (M,) Pa: exact where Q is a
        straight line from sample to sample. What a recording begins with came at once, from rest."""
        if not self:
            return torch.zeros_like(stress)
        modulus, time = self.arms(values)
        begun, _ = recording.ends
        clock = (recording.time - recording.time[begun])[:, None]
        parts = lag(stress[:, None].expand(-1, len(time)), recording, time)  # type: ignore[arg-type]
        return (parts + stress[begun][:, None] * torch.exp(-clock / time)) @ modulus

    def order(self, values: Mapping[str, float]) -> list[str]:
        """The names in `declared` with Prony arms in the order of their times, the shortest first."""
        names = [name.removesuffix(".time") for name in self.declared if name.endswith(".time")]
        ordered = sorted(names, key=lambda name: values[f"{name}.time"])
        arms = [f"{name}.{of}" for name in ordered for of in ("modulus", "time")]
        return [*arms, *(name for name in self.declared if name not in arms)]


def _modulus() -> Parameter:
    return Parameter("modulus", "G", "Pa", start=1e5, lower=1e-3, upper=1e10, log=True)


def _time(start: float, span: tuple[float, float]) -> Parameter:
    return Parameter("time", "τ", "s", start=start, lower=span[0] / 10, upper=10 * span[1], log=True)
