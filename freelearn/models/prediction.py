"""What a model says about a configuration: loads, and whether they mean anything."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from torch import Tensor


class Status(IntEnum):
    """Why a row's loads cannot be trusted. Rows other than OK are counted, and neither fitted nor scored."""

    OK = 0
    NO_EQUILIBRIUM = 1  # no inner radius carries the pressure; the loads are those of a ballooned tube
    SINGULAR = 2  # fibers (nearly) parallel to the axis: the linear model divides by Φ + φ
    OVERSTRETCHED = 3  # longer than an inextensible fiber allows; the formula still returns a number


class Prediction(NamedTuple):
    """loads: (N, 2) force [N] and moment [N·m]; of a whole chain, what its bed measures in their place (Bed.readings),
    SI. status: (N,) uint8 values of Status."""

    loads: Tensor
    status: Tensor
