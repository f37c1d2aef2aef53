"""Which of several answers is told, on a spring that snaps, whose answers are known in closed form."""

import numpy as np
import pandas as pd
import pytest
import torch
from fitted_folders import design, fitted
from scipy.optimize import root

from freelearn.data.beds import NMM
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.models.build import MODELS

STIFF, SNAP, PUSH, TURN = 800.0, 0.02, 2e-5, 4e-8


class Stiffness(Parameters):
    axial: torch.Tensor = parameter("k", "N/m", start=STIFF, scale=STIFF, lower=0.0, log=True)


class Snap(Model[Stiffness]):
    """F = P a − k Δl, M = P b − s φ (φ − 1)(φ − 2): at rest near no twist, and near two radians."""

    name = "snap"
    parameter_class = Stiffness
    conservative = True

    def structure(self, states, p):
        turn = states.twist * (states.twist - 1) * (states.twist - 2)
        force = PUSH * states.pressure - p.axial * (states.length - states.reference_length)
        return torch.stack([force, TURN * states.pressure - SNAP * turn], dim=-1)


def twists(moment, pressure=0.0):
    """Every twist [rad] that carries a moment [N·m], and whether it stays: the cubic's roots."""
    found = np.roots([SNAP, -3 * SNAP, 2 * SNAP, moment - TURN * pressure])
    real = np.sort(found[np.abs(found.imag) < 1e-9].real)
    return real, 3 * real**2 - 6 * real + 2 > 0


@pytest.fixture(scope="module")
def snap(tmp_path_factory):
    MODELS["snap"] = Snap
    places = [(dl, turn, p) for dl in (-4.0, 0.0, 4.0) for turn in (-60.0, 60.0, 140.0) for p in (0.0, 20.0, 40.0)]
    table = pd.DataFrame(places, columns=["elongation_mm", "twist_deg", "pressure_kpa"])
    table = table.assign(**design(3), step=0, buckled=0, force_n=0.0, moment_nmm=0.0)
    yield fitted(tmp_path_factory.mktemp("snap"), Snap(), table)
    del MODELS["snap"]


# The branch from rest turns back at s·0.385 = 7.7 N·mm of moment.
@pytest.mark.parametrize("moment", [-7.0, -3.0, 0.0, 3.0, 7.0, 8.5, -8.5])
def test_the_place_that_a_slow_rise_from_rest_reaches_is_told(snap, moment):
    answers = snap.invert(pd.DataFrame({"pressure_kpa": [0.0], "force_n": 0.4, "moment_nmm": moment}))
    there, stays = twists(moment * NMM)
    row = answers.filled.iloc[0]
    assert (row["status"], row["solutions"]) == ("ok", len(there))
    assert row["elongation_mm"] == pytest.approx(-1e3 * 0.4 / STIFF)
    if len(there) > 1:
        np.testing.assert_allclose(np.radians(np.sort(answers.every["twist_deg"])), there, atol=1e-9)
        assert answers.every.sort_values("twist_deg")["stable"].tolist() == stays.astype(int).tolist()
    # SciPy follows the branch; past its end there is one answer alone.
    at = 0.0
    for share in np.linspace(0, 1, 201):
        step = root(lambda x, s=share: x**3 - 3 * x**2 + 2 * x + s * moment * NMM / SNAP, at, jac=None)
        at = step.x[0] if step.success and abs(step.x[0] - at) < 0.3 else at
    wanted = at if abs(moment) < 7.7 else there[0]
    assert np.radians(row["twist_deg"]) == pytest.approx(wanted, abs=1e-8)


def test_of_the_twists_at_a_pressure_that_is_asked_for_one_that_stays_is_told(snap):
    question = pd.DataFrame({"elongation_mm": [0.0], "force_n": [0.5], "moment_nmm": [0.0]})
    row = snap.invert(question).filled.iloc[0]
    assert row["pressure_kpa"] == pytest.approx(0.5 / PUSH / 1e3)
    there, stays = twists(0.0, 0.5 / PUSH)
    assert row["solutions"] == len(there)
    assert np.abs(there[stays] - np.radians(row["twist_deg"])).min() < 1e-8


def test_what_is_held_cannot_leave(snap):
    """At a twist of one radian the spring pushes to either side, but the rig holds it: the loads there are an answer,
    and so is the length at a force."""
    held = pd.DataFrame({"twist_deg": [np.degrees(1.0)], "pressure_kpa": 0.0, "force_n": [0.4]})
    row = snap.invert(held).filled.iloc[0]
    assert row["status"] == "ok"
    assert row["moment_nmm"] == pytest.approx(0.0, abs=1e-9)


def test_under_a_moment_alone_at_a_held_length_the_twist_must_stay(snap):
    row = snap.invert(pd.DataFrame({"elongation_mm": [1.0], "pressure_kpa": 0.0, "moment_nmm": [3.0]})).filled.iloc[0]
    there, _ = twists(3 * NMM)
    assert row["solutions"] == 3
    assert np.radians(row["twist_deg"]) == pytest.approx(there[0], abs=1e-8)
