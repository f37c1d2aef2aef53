"""A physical parameter: what it is called, what it may be, and the unbounded number that a fit moves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

# How many deviations from the middle a parameter is still plausible: 99 % of a normal distribution, and 99.9 % of what
# is known of an effect's size, which says less of actuators that nobody has measured yet.
PLAUSIBLE, PLAUSIBLE_EFFECT = 2.576, 3.29
# Of what is declared without a prior: decades for a logarithm, and noticeable effects for another number.
DECADES, EFFECTS = 1.0, 3.0


@dataclass(frozen=True)
class Prior:
    """What is known of a parameter before its table is looked at: a normal distribution.

    middle: SI. deviation: SI, or, of a parameter whose logarithm a fit moves, of its natural logarithm. of: the reading
    (force, moment) whose largest value both count in, where sensors and mounts differ in proportion to it. common:
    share of the variance that samples, or members, of one table have in common: tubes are cut from one stock.
    """

    middle: float
    deviation: float
    source: str = ""
    of: str = ""
    common: float = 0.8


@dataclass(frozen=True)
class Parameter:
    """Declaration of one scalar physical parameter, in SI.

    start: value before any fit. none: value at which it has no effect (None for a parameter without one).
    lower, upper: bounds that the fit respects. log: the fit moves the logarithm, so the value stays positive
    and its scale does not matter. source: where the standard form comes from. per_sample: a fit of several samples
    has one value for each. per_member: each of several actuators on one end block has one. scale: size of a noticeable
    effect (of a plausible one, for a parameter that has no value without effect); every parameter of an effect has it.
    prior: what is known of it beforehand; None for a wide one about no effect, or about the start.
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
    prior: Prior | None = None

    @property
    def fixed(self) -> bool:
        """Whether it may have one value alone: no fit moves it, and nothing is its derivative."""
        return self.lower == self.upper

    @property
    def known(self) -> Prior:
        """The prior that was declared, or a wide one."""
        if self.prior is not None:
            return self.prior
        if self.log:
            return Prior(self.start, DECADES * math.log(10.0))
        middle = self.start if self.none is None else self.none
        return Prior(middle, EFFECTS * self.scale if self.scale else math.inf)

    @property
    def far(self) -> float:
        """Deviations from the middle of its prior up to which it is plausible."""
        return PLAUSIBLE if self.none is None or self.log else PLAUSIBLE_EFFECT

    def plausible(self, spans: Mapping[str, float]) -> tuple[float, float]:
        """Lowest and highest value in SI that its prior and its bounds allow. spans: see `models.priors`."""
        if self.fixed:
            return self.lower, self.upper
        prior = self.known
        size = spans.get(prior.of, 1.0)
        if self.log:
            ends = [prior.middle * size * math.exp(sign * self.far * prior.deviation) for sign in (-1, 1)]
        else:
            ends = [size * (prior.middle + sign * self.far * prior.deviation) for sign in (-1, 1)]
        return max(ends[0], self.lower), min(ends[1], self.upper)

    def to_raw(self, value: float) -> Tensor:
        """The raw number, (), of a value in SI: its logarithm where the fit moves that."""
        raw = math.log(value) if self.log else value
        return torch.tensor(raw, dtype=torch.float64)

    def to_physical(self, raw: Tensor) -> Tensor:
        """The value in SI of a raw number, differentiable; a constant where it is fixed."""
        if self.fixed:
            return torch.full_like(raw, self.lower)
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
