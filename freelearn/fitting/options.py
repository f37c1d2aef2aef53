"""How to fit. Light to import: settings are checked before anything heavy is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from annotated_types import Ge, Gt
from pydantic import Strict

LEVENBERG_MARQUARDT = "levenberg_marquardt"
# Kinds of intervals (see fit.uncertainty and fit.profile).
Intervals = Literal["normal", "profile"]
NORMAL: Intervals = "normal"
PROFILE: Intervals = "profile"
# What an option of an optimizer may be.
Option = bool | int | float | str | tuple[float, ...] | None


@dataclass(frozen=True)
class FitOptions:
    """How to fit. name: levenberg_marquardt, or an optimizer of torch.optim in lower case.

    restarts: members fitted side by side, the best kept. patience: epochs without a better validation error before a
    member stops. tolerance and race (epochs after which only the best member goes on) belong to Levenberg-Marquardt,
    the others to the gradient algorithms: learning_rate, the peak of the one-cycle schedule; batch_size [rows];
    weight_decay; optimizer, further options of the optimizer by its own names, such as {"momentum": 0.9}. intervals:
    of the physical parameters, from their standard errors (normal) or from the profile of the sum of squares (profile).
    """

    name: str
    max_epochs: Annotated[int, Strict(), Ge(1)]
    restarts: Annotated[int, Strict(), Ge(1)]
    patience: Annotated[int, Strict(), Ge(1)]
    tolerance: Annotated[float, Strict(), Ge(0)] = 1e-10
    race: Annotated[int, Strict(), Ge(1)] | None = None
    learning_rate: Annotated[float, Strict(), Gt(0)] = 1e-2
    batch_size: Annotated[int, Strict(), Ge(1)] = 128
    weight_decay: Annotated[float, Strict(), Ge(0)] = 0.0
    optimizer: Mapping[str, Option] = field(default_factory=dict)
    intervals: Intervals = NORMAL

    # Read where settings are checked: nothing unknown is let through.
    __pydantic_config__: ClassVar[dict[str, object]] = {"extra": "forbid"}
