"""What effects and models of one's own are written with: `from freelearn.own import BoundaryEffect, States, …`.

Where these names live inside the package may change; here they stay. An effect derives from the base class of its port
and writes that port's one method; a model derives from `Model` and writes `structure`. The file that holds them is
named by FREELEARN_EFFECTS or FREELEARN_MODELS.
"""

from freelearn.measurements.recording import Recording
from freelearn.measurements.rows import Rows
from freelearn.measurements.states import States
from freelearn.mechanics.energy import Energy, NeoHookean, StandardFiber
from freelearn.mechanics.inextensible import Helix, helix
from freelearn.models.base import Model
from freelearn.models.continuum import Continuum
from freelearn.models.lags import delayed, held, lag
from freelearn.models.material import Material
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import (
    BoundaryEffect,
    DissipationEffect,
    EndEffect,
    EnergyEffect,
    EvasionEffect,
    GeometryEffect,
    HistoryEffect,
    MeasurementEffect,
    MountEffect,
    PlayEffect,
    TiltEffect,
    WallEffect,
    columns,
)
from freelearn.models.prediction import Prediction, Status

__all__ = [
    "BoundaryEffect", "Continuum", "DissipationEffect", "EndEffect", "Energy", "EnergyEffect", "EvasionEffect",
    "GeometryEffect", "Helix", "HistoryEffect", "Material", "MeasurementEffect", "Model", "MountEffect", "NeoHookean",
    "Parameters", "PlayEffect", "Prediction", "Prior", "Recording", "Rows", "StandardFiber", "States", "Status",
    "TiltEffect", "WallEffect", "columns", "delayed", "held", "helix", "lag", "parameter",
]  # fmt: skip
