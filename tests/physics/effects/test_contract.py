"""The contract of freelearn.testing.effects for every effect of the library on every model that it can join."""

from freelearn.physics.effects.registry import EFFECTS
from freelearn.testing.effects import TRUTH, EffectContract

# Constants of an effect's module that have a unit.
CONSTANTS = {"threshold_pressure": {"ONSET": "Pa"}, "valve_flow": {"ATMOSPHERE": "Pa", "THINNEST": "Pa"}}
# Every class is a test class of its own: Test_end_clamps_linear and so on.
for _name, _kind in EFFECTS.items():
    for _family in TRUTH:
        if _family in _kind.families():
            _own = {"effect": _kind, "family": _family, "constants": CONSTANTS.get(_name, {})}
            _title = f"Test_{_name}_{_family}"
            globals()[_title] = type(_title, (EffectContract,), _own)
