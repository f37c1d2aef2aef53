"""Effects of the history, hidden by small steps of integration in logs of a bed apart, are found again by a fit."""

import pytest
import torch

from freelearn.data.rows import Rows
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.simulated_logs import C1, C2, UNIT, log

OPTIONS = FitOptions("levenberg_marquardt", max_epochs=60, restarts=1, patience=6)
# A distribution of five elements is not one of sixty; five rows a swing, or two while a valve is wide open, are few;
# gas is vented at its own temperature.
WITHIN = {"maxwell_slip": 0.15, "contact_slip": 0.15, "inertia": 0.1, "valve_flow": 0.2, "gas_warming": 0.1}
# No pressure here comes to the speed of sound.
UNTOLD = ["valve_flow.critical"]


@pytest.mark.parametrize("name", UNIT)
def test_a_fit_finds_what_small_steps_have_hidden(name):
    """Hardly any noise: what is left is the error of straight lines between the rows, and of few elements."""
    rows = Rows.from_table(log({name: UNIT[name]}, 1, recordings=4, rate=10.0, seconds=10.0, noise=0.02))
    model, bare = build_model("continuum", effects=[name]), build_model("continuum", {"C1": C1, "C2": C2})
    fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
    found = model.scalars()
    for label, value in UNIT[name].items():
        if value and f"{name}.{label}" not in UNTOLD:
            assert found[f"{name}.{label}"] == pytest.approx(value, rel=WITHIN.get(name, 0.05)), label
    left, lost = (Problem(m, rows).residual(m.vector()).detach().square().mean() ** 0.5 for m in (model, bare))
    assert left < 0.2 * lost


def test_a_single_lag_stands_for_seven_eighths_of_a_warming_gas():
    """Of what the gas does to the readings, refitted with C1 and C2: so short lines leave the two a class."""
    name = "gas_warming"
    rows = Rows.from_table(log({name: UNIT[name]}, 1, recordings=4, rate=10.0, seconds=10.0, noise=0.02))
    left = {}
    for effects in ((), ("supply_lag",)):
        model = build_model("continuum", effects=list(effects))
        fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
        left[effects] = float(Problem(model, rows).residual(model.vector()).detach().square().mean() ** 0.5)
    assert left["supply_lag",] / left[()] == pytest.approx(1 / 8, abs=0.02)
