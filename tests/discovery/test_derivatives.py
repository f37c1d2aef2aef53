"""Derivatives of effects that are not in the model yet: the quick way behind the structure against the whole chain."""

import pytest
import torch

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.discovery.fits.derivatives import trials
from freelearn.discovery.fits.white_fit import ONE, white_fit
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.fitting.problem import Problem
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

NAMES = ["relaxation", "stress_softening", "friction_hysteresis", "force_gain", "sensor_drift", "twist_slack"]


@pytest.mark.parametrize("given", [[], ["relaxation"], ["end_clamps", "stress_softening"]])
def test_what_acts_behind_the_structure_has_the_derivatives_of_the_whole_chain(given):
    def build(more):
        return build_model("continuum", TRUTH["continuum"], [*given, *more])

    table = visits(count=8)
    states = States.from_table(table)
    model = build([])
    with torch.no_grad():
        loads = model(states).loads * 1.02
    rows = Rows.whole(states, loads, kinematic_state(table))
    whiten = Whitener(sensitivities(model, states), torch.as_tensor(rows.state), PAPER)
    fit = white_fit(model, rows, whiten, model.vector().detach())
    for trial in trials(fit, rows, whiten, [n for n in NAMES if n not in given], build):
        whole = Problem(trial.model, rows, ONE).jacobians(trial.vector[None])[0].reshape(len(rows), 2, -1)
        places = [trial.model.labels().index(label) for label in trial.labels]
        expected = whiten(whole[:, :, places]).flatten(0, 1)
        scale = float(expected.abs().max())
        torch.testing.assert_close(trial.columns, expected, rtol=1e-7, atol=1e-9 * scale)
