"""Pressure that arrives after a while: sound in a long line, a controller's cycle, clocks that do not agree."""

from torch import Tensor

from freelearn.measurements.recording import Recording
from freelearn.measurements.states import States
from freelearn.models.lags import LONGEST, delayed
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import HistoryEffect


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
