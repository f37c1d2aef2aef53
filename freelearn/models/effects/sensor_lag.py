"""Gauges, filters and markers that show late what they measure."""

import torch
from torch import Tensor

from freelearn.measurements.recording import Recording
from freelearn.measurements.states import States
from freelearn.models.lags import lag
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import HistoryEffect

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

    def carry(self, signal: Tensor, recording: Recording[States], p: Late) -> Tensor:
        """As HistoryEffect.carry."""
        return signal - lag(signal, recording, torch.stack([p.force, p.moment]))
