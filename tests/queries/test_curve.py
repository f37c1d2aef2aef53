"""A curve at one kinematic state goes where the model's own predictions are, memory and all."""

import beds
import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.beds import NMM
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.queries.curves.model_curves import state_curves

FRICTION = {"friction_hysteresis.force": 2.0, "friction_hysteresis.moment": 0.05}
EFFECTS = (
    {},
    FRICTION,
    {"stress_softening.depth": 0.3, "stress_softening.severity": 0.1},
    {"relaxation.share": 0.2, "relaxation.time": 30.0},
)


def continuum(values):
    return build_model("continuum", values, sorted({name.split(".")[0] for name in values}))


@pytest.fixture
def table():
    """Two visits of one actuator: the first works the rubber hard, the second rises and falls; one row is buckled."""
    visits = [(4.0, 60.0, [0, 20, 40, 60]), (1.0, 20.0, [5, 20, 35, 50, 30, 10])]
    rows = [
        {"elongation_mm": elongation, "twist_deg": twist, "step": step, "pressure_kpa": float(pressure)}
        for elongation, twist, pressures in visits
        for step, pressure in enumerate(pressures)
    ]
    design = {"sample": 1, "gamma_deg": 40.0, "length_mm": 100.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
    table = pd.DataFrame(rows).assign(**design, force_n=0.0, moment_nmm=0.0, buckled=0)
    table["time_s"] = 10.0 * np.arange(len(table))
    table.loc[9, "buckled"] = 1
    return table


@pytest.mark.parametrize("values", EFFECTS, ids=lambda values: next(iter(values), "none"))
def test_the_curve_passes_through_every_prediction_of_the_state(table, values):
    model = continuum(values)
    rows = np.arange(4, 10)
    curve = state_curves({"m": model}, table, [rows])[0][1]["m"]
    with torch.no_grad():
        loads = model(States.from_table(table))[0].numpy()[rows]
    for force, moment, pressure in zip(*loads.T, table["pressure_kpa"][rows], strict=True):
        off = (
            (curve["pressure_kpa"] - pressure).abs()
            + (curve["force_pred_n"] - force).abs()
            + (curve["moment_pred_nmm"] - moment / NMM).abs()
        )
        assert off.min() < 1e-6
    assert curve["pressure_kpa"].iloc[0] == 0.0
    # Un-buckled from 5 to 50 kPa; the path falls to 10 kPa, inside of that.
    assert curve.loc[curve["extrapolated"], "pressure_kpa"].max() < 5


def test_rising_and_falling_pressure_draw_two_branches_only_where_the_model_has_them(table):
    for values, apart in (({}, 0.0), (FRICTION, 4.0)):
        curve = state_curves({"m": continuum(values)}, table, [np.arange(4, 10)])[0][1]["m"]
        up, down = curve[: curve["pressure_kpa"].idxmax() + 1], curve[curve["pressure_kpa"].idxmax() + 1 :]
        at = [np.interp(40.0, *half.sort_values("pressure_kpa")[["pressure_kpa", "force_pred_n"]].T.to_numpy())
              for half in (up, down)]  # fmt: skip
        assert at[1] - at[0] == pytest.approx(apart, abs=0.02)


def test_a_curve_of_an_end_block_begins_where_its_moving_actuator_is_at_rest():
    generator = np.random.default_rng(0)
    block = beds.block({})[:8].reset_index(drop=True)
    for name, level in (("pressure_2_kpa", 40.0), ("pressure_3_kpa", 10.0)):
        block[name] = level + generator.uniform(-1, 1, len(block))
    table = with_members(block, beds.MEMBERS)
    model = build_model("continuum", {}, [], members=3)
    curve = state_curves({"m": model}, table, [np.arange(8)])[0][1]["m"]
    start = curve.iloc[0]
    assert start["pressure_1_kpa"] == 0
    assert start["pressure_2_kpa"] == pytest.approx(block["pressure_2_kpa"][0])
    assert start["pressure_3_kpa"] == pytest.approx(block["pressure_3_kpa"][0])
    # Held pressures stay where they were: no zigzag from rest.
    assert curve["pressure_2_kpa"].between(39, 41).all()


def test_a_long_way_is_drawn_as_finely_as_a_short_one(table):
    falls = table[4:].assign(pressure_kpa=[60.0, 50, 35, 20, 10, 5], buckled=0)
    curve = state_curves({"m": continuum({})}, falls.reset_index(drop=True), [np.arange(6)])[0][1]["m"]
    assert curve["pressure_kpa"].diff().abs().max() < 4
    for column in ("force_pred_n", "moment_pred_nmm"):
        up, down = curve[: curve["pressure_kpa"].idxmax() + 1], curve[curve["pressure_kpa"].idxmax() :][::-1]
        at = np.linspace(6, 59, 30)
        there, back = (np.interp(at, half["pressure_kpa"], half[column]) for half in (up, down))
        assert np.abs(there - back).max() < 1e-3 * np.ptp(curve[column])
