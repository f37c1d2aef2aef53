"""Pressure and readings that come late: behind a valve and a line, after a dead time, through a filter."""

import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import LONGEST, delayed, lag
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect


class Line(Parameters):
    """time: in which all but 1/e of a step has come through."""

    time: Tensor = parameter(
        "τ",
        "s",
        start=0.05,
        lower=0.0,
        upper=60.0,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.3, "lines of meters and valves: tenths of a second, Andersen (1967)"),
    )


class SupplyLag(HistoryEffect[Line]):
    """τ P' = P shown − P: the pressure in the actuator behind the one that was commanded, or read at the valve."""

    name = "supply_lag"
    place = 0
    acts_on = "supply"
    suspect = "The actuator follows the pressure late, as if that had to come through a narrow line."
    source = "first-order line: Andersen, The Analysis and Design of Pneumatic Systems (1967)"
    parameter_class = Line
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Line) -> Tensor:
        """As HistoryEffect.carry."""
        return signal - lag(signal, recording, p.time)


class Delay(Parameters):
    """delay: time by which the pressure comes later than the table says; negative: by which the readings are late."""

    delay: Tensor = parameter(
        "T",
        "s",
        start=0.0,
        lower=-LONGEST,
        upper=LONGEST,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.2, "controllers' cycles and channels of two clocks: up to tenths of a second"),
    )


class DeadTime(HistoryEffect[Delay]):
    """P(t) = P shown (t − T), a straight line from sample to sample; before a recording, what it began with."""

    name = "dead_time"
    place = 1
    acts_on = "supply"
    suspect = "The readings are those of a little earlier, or later, at every rate by the same time."
    source = "transport delay: Doebelin, Measurement Systems (2003)"
    parameter_class = Delay
    loose = 0.02

    def carry(self, signal: Tensor, recording: Recording[States], p: Delay) -> Tensor:
        """As HistoryEffect.carry."""
        return delayed(signal, recording, p.delay)


KNOWN = Prior(0.0, 0.2, "data sheets of amplifiers and cameras: milliseconds to tenths of a second")


class Late(Parameters):
    """force, moment: time constants of the two channels (of elongation and twist, where those are measured)."""

    force: Tensor = parameter("τ_F", "s", start=0.02, lower=0.0, upper=60.0, none=0.0, scale=0.1, prior=KNOWN)
    moment: Tensor = parameter("τ_M", "s", start=0.02, lower=0.0, upper=60.0, none=0.0, scale=0.1, prior=KNOWN)


class SensorLag(HistoryEffect[Late]):
    """τ y' = x − y of each channel by itself: x what is there, y what the sensor shows."""

    name = "sensor_lag"
    place = 9
    acts_on = "readings"
    suspect = "The readings follow the pressure late, up and down alike, and the later the faster it changes."
    source = "first-order sensor: Doebelin, Measurement Systems (2003)"
    parameter_class = Late
    loose = 0.02
    alike = ("force", "moment")

    def carry(self, signal: Tensor, recording: Recording[States], p: Late) -> Tensor:
        """As HistoryEffect.carry."""
        return signal - lag(signal, recording, torch.stack([p.force, p.moment]))
