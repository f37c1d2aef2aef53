"""What effects and models of one's own are written with: `from freelearn.own import BoundaryEffect, States, …`.

Where these names live inside the package may change; here they stay. An effect derives from the base class of its port
and writes that port's one method; a model derives from `Model` and writes `structure`. The file that holds them is
named by FREELEARN_EFFECTS or FREELEARN_MODELS.
"""

from freelearn.data.recordings import Recording, followed
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.lags import delayed, held, lag, rung
from freelearn.physics.chain.material import Material
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import (
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
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.mechanics.energy import Energy, NeoHookean, StandardFiber
from freelearn.physics.mechanics.inextensible import Helix, helix
from freelearn.physics.models.continuum import Continuum

__all__ = [
    "BoundaryEffect", "Continuum", "DissipationEffect", "EndEffect", "Energy", "EnergyEffect", "EvasionEffect",
    "GeometryEffect", "Helix", "HistoryEffect", "Material", "MeasurementEffect", "Model", "MountEffect", "NeoHookean",
    "Parameters", "PlayEffect", "Prediction", "Prior", "Recording", "Rows", "StandardFiber", "States", "Status",
    "TiltEffect", "WallEffect", "columns", "delayed", "followed", "held", "helix", "lag", "parameter", "rung",
]  # fmt: skip
