"""The package against the reference bed, which was written apart from it: the effects whose definitions are subtle."""

import numpy as np
import pytest
import torch

from freelearn.measurements.states import States
from freelearn.models.build import build_model
from freelearn.testing.reference.bed import bed_loads, nominal, state_of

MATERIAL = {"C1": 1e6, "C2": 4e7}
CASES = {
    "play": {"twist_slack": {"angle": 0.2}},
    "play with friction": {
        "twist_slack": {"angle": 0.2},
        "friction_hysteresis": {"force": 0.5, "moment": 5e-3},
    },
    "play on a soft shaft": {"twist_slack": {"angle": 0.2}, "twist_compliance": {"compliance": 0.2}},
    "relaxation": {"relaxation": {"share": 0.2, "time": 45.0}},
    "softening and friction": {
        "stress_softening": {"depth": 0.2, "severity": 0.02},
        "friction_hysteresis": {"force": 0.5, "moment": 5e-3},
    },
    "all of it": {
        "twist_slack": {"angle": 0.1},
        "relaxation": {"share": 0.2, "time": 45.0},
        "stress_softening": {"depth": 0.1, "severity": 0.02},
        "twist_offset": {"angle": 0.05},
    },
}


@pytest.mark.parametrize("case", CASES)
def test_both_write_the_same_physics(case):
    effects = CASES[case]
    table = nominal([4], 0.03, np.random.default_rng(3))
    table["twist_deg"] *= 0.2
    expected, found = bed_loads(state_of(table), MATERIAL["C1"], MATERIAL["C2"], effects)
    values = {f"{effect}.{name}": v for effect, parameters in effects.items() for name, v in parameters.items()}
    model = build_model("continuum", MATERIAL | values, list(effects))
    with torch.no_grad():
        loads, status = model(States.from_table(table))
    assert found.all()
    assert (status == 0).all()
    np.testing.assert_allclose(loads.numpy(), expected, rtol=1e-6, atol=1e-7)
    if "twist_slack" in effects:
        resting = np.abs(expected[:, 1]) < 1e-7
        assert 0 < resting.sum() < len(resting) or "friction_hysteresis" in effects
