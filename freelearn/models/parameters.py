"""Physical parameters as a class of tensors: declared once, read as attributes."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import Any, ClassVar, get_args, get_origin

from torch import Tensor
from typing_extensions import TypeVar

from freelearn.models.parameter import Parameter, Prior

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

    The arguments are those of `freelearn.models.parameter.Parameter`, in SI.
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
