"""Physical parameters: what one is called and may be, and a class of them as tensors, declared once."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, get_args, get_origin

import torch
from torch import Tensor
from typing_extensions import TypeVar

from freelearn.common.some_rows import some_rows

# A physical parameter: what it is called, what it may be, and the unbounded number that a fit moves.

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
        """Lowest and highest value in SI that its prior and its bounds allow. spans: see `priors`."""
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


# Physical parameters as a class of tensors: declared once, read as attributes.

if sys.version_info >= (3, 11):
    from typing import dataclass_transform
else:
    from typing_extensions import dataclass_transform


def parameter(
    symbol: str,
    unit: str,
    *,
    start: float,
    lower: float = -math.inf,
    upper: float = math.inf,
    none: float | None = None,
    log: bool = False,
    per_sample: bool = False,
    scale: float | None = None,
    source: str = "",
    per_member: bool = False,
    prior: Prior | None = None,
) -> Any:
    """Declares one physical parameter inside a class of `Parameters`; the attribute's name is the parameter's.

    The arguments are those of `freelearn.physics.chain.parameters.Parameter`, in SI.
    """
    return Parameter("", symbol, unit, start, lower, upper, none, log, source, per_sample, scale, per_member, prior)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter,))
class Parameters:
    """Base of the classes that declare parameters. An instance holds their values in SI: tensors, () or (N,).

    >>> import torch
    >>> class Loss(Parameters):
    ...     share: Tensor = parameter("s", "1", start=0.0, lower=0.0, upper=0.9, none=0.0, scale=0.05)
    >>> [p.name for p in Loss.records()]
    ['share']
    >>> Loss(share=torch.tensor(0.25)).share
    tensor(0.2500)

    Raises TypeError where a parameter has the name of one of this class's methods.
    """

    _records: ClassVar[tuple[Parameter, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        own = [replace(value, name=name) for name, value in vars(cls).items() if isinstance(value, Parameter)]
        for record in own:
            if hasattr(Parameters, record.name):
                raise TypeError(f"{record.name!r} cannot be the name of a parameter: choose another")
            delattr(cls, record.name)
        known = {record.name: record for record in (*cls._records, *own)}
        cls._records = tuple(known.values())

    def __init__(self, **values: Tensor) -> None:
        names = [record.name for record in self._records]
        if set(values) != set(names):
            raise TypeError(f"{type(self).__name__} takes {', '.join(names) or 'nothing'}, not {', '.join(values)}")
        # An instance's dictionary is the quickest store, and `__setattr__` keeps everyone else out of it.
        self.__dict__.update(values)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__}.{name} cannot be changed: parameters are read only")

    @classmethod
    def records(cls) -> tuple[Parameter, ...]:
        """What was declared, in the order of declaration."""
        return cls._records

    def detach(self: P) -> P:
        """The same values, cut from every derivative."""
        return type(self)(**{name: value.detach() for name, value in vars(self).items()})

    def some(self: P, rows: Tensor, count: int) -> P:
        """The values in some of so many rows, (n,) int64."""
        return type(self)(**{name: some_rows(value, rows, count) for name, value in vars(self).items()})


# Where nothing is said of the parameters, any will do: `Model` is `Model[Any]`.
P = TypeVar("P", bound=Parameters, default=Any)


def misnamed(cls: type, parameter_class: type[Parameters]) -> str | None:
    """What is wrong where a class derives from Base[A] and its parameter_class is not A; None where they agree."""
    for base in getattr(cls, "__orig_bases__", ()):
        for named in get_args(base):
            if isinstance(named, type) and issubclass(named, Parameters) and not issubclass(parameter_class, named):
                whole = f"{get_origin(base).__name__}[{named.__name__}]"
                return f"it derives from {whole}: write parameter_class = {named.__name__}"
    return None
