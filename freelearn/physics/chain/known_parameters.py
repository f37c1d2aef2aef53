"""What a user knows of a model's parameters before any fit: values that hold, bounds, and values with an error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from freelearn.common.errors import UserError
from freelearn.physics.chain.parameters import Parameter, Prior

Said = TypeVar("Said")

# So many times as wide is a declared prior where a user wants none: flat beside any table, and still one that sets of
# effects can be weighed by.
FLAT = 100.0
# What is said of a parameter that is held.
FIXED = "fixed"


@dataclass(frozen=True)
class Known:
    """Of parameters by label: C1, end_clamps.clamp_length, or length_offset.length[3] for one sample's alone.

    starts: values of effects' parameters before a fit, SI. fixed: held where they are in every fit. bounds: lowest and
    highest value, SI. priors: in place of those declared. flat: whether those declared count for nothing.
    """

    starts: Mapping[str, float] = field(default_factory=dict)
    fixed: Sequence[str] = ()
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    priors: Mapping[str, Prior] = field(default_factory=dict)
    flat: bool = False

    @property
    def nothing(self) -> bool:
        """Whether nothing was said."""
        return not (self.starts or self.fixed or self.bounds or self.priors or self.flat)

    def plain(self) -> dict[str, Any]:
        """As containers, texts and numbers, in a fixed order; `from_plain` reads it."""
        return {
            "starts": dict(sorted(self.starts.items())),
            "fixed": sorted(self.fixed),
            "bounds": {label: list(self.bounds[label]) for label in sorted(self.bounds)},
            "priors": {label: vars(self.priors[label]) for label in sorted(self.priors)},
            "flat": self.flat,
        }

    @classmethod
    def from_plain(cls, content: Mapping[str, Any]) -> Known:
        """What `plain` gave."""
        return cls(
            dict(content.get("starts", {})),
            tuple(content.get("fixed", ())),
            {label: (low, high) for label, (low, high) in content.get("bounds", {}).items()},
            {label: Prior(**prior) for label, prior in content.get("priors", {}).items()},
            bool(content.get("flat", False)),
        )

    def holds(self, label: str) -> bool:
        """Whether a parameter is held where it is."""
        return label in self.fixed or _whole(label) in self.fixed

    def bounded(self, label: str) -> tuple[float, float] | None:
        """Lowest and highest value that were given, SI."""
        return _said(self.bounds, label)

    def prior(self, label: str) -> Prior | None:
        """The prior that was given."""
        return _said(self.priors, label)

    def told(self, label: str, p: Parameter, value: float) -> tuple[Parameter, float]:
        """The parameter's declaration as it is now, and its value, SI. value: before. Raises UserError."""
        start = _said(self.starts, label)
        value = value if start is None else start
        prior = self.prior(label)
        if prior is not None:
            p = replace(p, prior=prior)
        elif self.flat:
            p = replace(p, prior=replace(p.known, deviation=FLAT * p.known.deviation))
        limits = self.bounded(label)
        if limits is not None:
            p, value = _within(label, p, value, limits)
        if self.holds(label):
            if not p.allows(value):
                raise UserError(
                    f"{label} = {value:g} {p.unit} cannot be held: it is outside {p.lower:g} … {p.upper:g}."
                )
            # Without the last digits, which a logarithm may have cost.
            value = float(f"{value:.14g}")
            p = replace(p, lower=value, upper=value, start=value)
        elif prior is not None and not p.lower <= prior.middle <= p.upper:
            raise UserError(
                f"{label} is known as {prior.middle:g} {p.unit}, and its bounds are {p.lower:g} … {p.upper:g}: "
                "widen these, or leave one of the two out."
            )
        return p, value

    def words(self, label: str, p: Parameter) -> str:
        """What was known of a parameter, in a table's cell; "" for nothing."""
        if self.holds(label):
            return FIXED
        parts = []
        if (prior := self.prior(label)) is not None:
            size = prior.middle * math.expm1(prior.deviation) if p.log else prior.deviation
            parts.append(f"{prior.middle:.3g} ± {abs(size):.2g}")
        if (limits := self.bounded(label)) is not None:
            parts.append(f"{limits[0]:.3g} … {limits[1]:.3g}")
        return ", ".join(parts)


def _within(label: str, p: Parameter, value: float, limits: tuple[float, float]) -> tuple[Parameter, float]:
    """The parameter with the bounds given, and its value drawn in to them. Raises UserError."""
    low, high = limits
    if low >= high:
        raise UserError(f"bounds of {label}, {low:g} … {high:g}, hold nothing: give the lower one first, or fix it.")
    if high <= p.lower or low >= p.upper or (p.log and high <= 0):
        raise UserError(
            f"bounds of {label}, {low:g} … {high:g}, are outside what it may be: {p.lower:g} … {p.upper:g}."
        )
    p = replace(p, lower=max(low, p.lower), upper=min(high, p.upper))
    # A logarithm keeps off zero.
    inside = [v for v in (p.start, value, p.lower, p.upper) if p.allows(v)]
    drawn = min(max(value, p.lower), p.upper)
    start = min(max(p.start, p.lower), p.upper)
    return replace(p, start=start if p.allows(start) else inside[0]), drawn if p.allows(drawn) else inside[0]


def _whole(label: str) -> str:
    """C1 of C1, length_offset.length of length_offset.length[3]."""
    return label.split("[")[0]


def _said(by_name: Mapping[str, Said], label: str) -> Said | None:
    """What was said of a parameter, or of all its samples."""
    return by_name.get(label, by_name.get(_whole(label)))
