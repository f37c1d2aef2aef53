"""Load cells that wander during a run."""

from collections.abc import Iterable

from torch import Tensor

from freelearn.data.states import SECONDS_PER_ROW, States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class Drift(Parameters):
    """force_rate, moment_rate: of the cells' zeros."""

    force_rate: Tensor = parameter(
        "a",
        "N/s",
        start=0.0,
        lower=-1.0,
        upper=1.0,
        none=0.0,
        scale=2e-5,
        prior=Prior(0.0, 5e-6, "load cells' data sheets: 5 % of the load in three hours", of="force"),
    )
    moment_rate: Tensor = parameter(
        "b",
        "N·m/s",
        start=0.0,
        lower=-1e-2,
        upper=1e-2,
        none=0.0,
        scale=2e-7,
        prior=Prior(0.0, 5e-6, "torque cells' data sheets: 5 % of the load in three hours", of="moment"),
    )


class SensorDrift(MeasurementEffect[Drift]):
    """F shown = F + a t, M shown = M + b t, t the time since the sample's first row (20 s a row without time_s)."""

    name = "sensor_drift"
    place = 8
    suspect = "Repeats of one state disagree, and more so the further apart they were measured."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Drift

    @classmethod
    def assumptions(cls, columns: Iterable[str]) -> list[str]:
        """As Effect.assumptions: the time from row to row, where the table does not tell it."""
        if "time_s" in set(columns):
            return []
        return [
            f"the table has no time_s: {cls.name} takes {SECONDS_PER_ROW:g} s from row to row, and its rates per "
            "second rest on that"
        ]

    def sense(self, loads: Tensor, states: States, p: Drift) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads + states.clock[:, None] * columns(p.force_rate, p.moment_rate)
