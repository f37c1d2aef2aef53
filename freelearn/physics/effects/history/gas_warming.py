"""Gas that warms as it is pressed in: behind a line the pressure is quicker at first, and the later in the end."""

from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import lag
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect

# Ratio of the specific heats of air: the polytropic exponent of what is too quick for the wall to cool it.
ADIABATIC = 1.4


class Warm(Parameters):
    """time: of the line, in which all but 1/e of a step would have come through if the gas kept the wall's temperature;
    cooling: in which all but 1/e of what the gas is warmer than the wall is gone."""

    time: Tensor = parameter(
        "τ",
        "s",
        start=0.05,
        lower=0.0,
        upper=60.0,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.3, "as supply_lag's: Andersen (1967)"),
    )
    cooling: Tensor = parameter(
        "τ_T",
        "s",
        start=1.0,
        lower=1e-3,
        upper=1e4,
        log=True,
        scale=1.0,
        prior=Prior(1.0, 1.5, "vessels of 1 ml to 10 l: tenths of a second to ten, Thorncroft et al. (2007)"),
    )


class GasWarming(HistoryEffect[Warm]):
    """τ q' = u − p, p' = κ q' − (p − q)/τ_T: u the pressure shown, p in the actuator, q its gas at the wall's
    temperature.

    The energy of an ideal gas in a closed volume to which gas of the wall's temperature comes, κ = 1.4 as of air: quick
    changes are adiabatic, slow ones isothermal, and between them the polytropic exponent is what cooling leaves. So p
    comes late by two lags, whose times are the roots of x² − (κ τ_T + τ) x + τ τ_T and whose shares add up to one and
    give the mean delay τ. Without cooling it is a supply_lag of τ/κ, with quick cooling one of τ. Vented gas is taken
    to leave at the wall's temperature instead of its own: off by a share (p − q)/p of its flow. The volume stays.
    """

    name = "gas_warming"
    place = 3
    acts_on = "supply"
    suspect = "After a quick step of its command the pressure is most of the way there at once, and late for the rest."
    source = (
        "Thorncroft, Patton & Gordon (2007), Modeling compressible air flow in a charging or discharging vessel; "
        "Richer & Hurmuzlu (2000)"
    )
    parameter_class = Warm
    loose = 0.05

    def carry(self, signal: Tensor, recording: Recording[States], p: Warm) -> Tensor:
        """As HistoryEffect.carry."""
        half = (ADIABATIC * p.cooling + p.time) / 2
        root = (half**2 - p.time * p.cooling).sqrt()
        slow = half + root
        quick = p.time * p.cooling / slow
        late = (p.time - quick) / (2 * root)
        return signal - late * lag(signal, recording, slow) - (1 - late) * lag(signal, recording, quick)
