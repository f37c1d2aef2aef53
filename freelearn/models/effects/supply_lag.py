"""Pressure that follows its command late: a valve, a line and a volume to fill."""

from torch import Tensor

from freelearn.measurements.recording import Recording
from freelearn.measurements.states import States
from freelearn.models.lags import lag
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import HistoryEffect


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
