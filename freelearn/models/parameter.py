"""A physical parameter: what it is called, what it may be, and the unbounded number that a fit moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Parameter:
    """Declaration of one scalar physical parameter, in SI.

    start: value before any fit. none: value at which it has no effect (None for a parameter without one).
    lower, upper: bounds that the fit respects. log: the fit moves the logarithm, so the value stays positive
    and its scale does not matter. source: where the standard form comes from. per_sample: a fit of several samples
    has one value for each. per_member: each of several actuators on one end block has one. scale: size of a noticeable
    effect (of a plausible one, for a parameter that has no value without effect); every parameter of an effect has it.
    """

    name: str
    symbol: str
    unit: str
    start: float
    lower: float = -math.inf
    upper: float = math.inf
    none: float | None = None
    log: bool = False
    source: str = ""
    per_sample: bool = False
    scale: float | None = None
    per_member: bool = False

    def to_raw(self, value: float) -> Tensor:
        """The raw number, (), of a value in SI: its logarithm where the fit moves that."""
        raw = math.log(value) if self.log else value
        return torch.tensor(raw, dtype=torch.float64)

    def to_physical(self, raw: Tensor) -> Tensor:
        """The value in SI of a raw number, differentiable."""
        return raw.exp() if self.log else raw

    def allows(self, value: float) -> bool:
        """Whether the parameter may have this value in SI."""
        return math.isfinite(value) and self.lower <= value <= self.upper and not (self.log and value <= 0)

    @property
    def raw_bounds(self) -> tuple[float, float]:
        """Lower and upper bound of the raw number."""
        if self.log:
            return (math.log(self.lower) if self.lower > 0 else -math.inf), math.log(self.upper)
        return self.lower, self.upper
