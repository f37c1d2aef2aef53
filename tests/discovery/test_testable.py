"""What the rows cannot show is no candidate."""

import numpy as np
import pytest
import torch
from hidden_tables import table

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.search.testable import assumptions, candidates, unseen
from freelearn.physics.models.build import build_model


def rows_of(data) -> Rows:
    rows = Rows.from_table(data)
    return rows[torch.as_tensor(np.flatnonzero(data["buckled"] == 0))]


@pytest.fixture(scope="module")
def whole():
    return table({}, share=0.1)


def test_the_whole_protocol_shows_every_effect_of_one_helix(whole):
    names, out, _ = candidates(build_model("continuum"), [], whole.columns, rows_of(whole))
    assert {"friction_hysteresis", "relaxation", "stress_softening"} <= set(names)
    reasons = {entry["effect"]: entry["reason"] for entry in out}
    assert set(reasons) == {"bladder_slack", "strand_jamming", "block_tilt", "buckling"}
    assert "isometric" in reasons["buckling"]
    assert "braid" in reasons["bladder_slack"]
    assert "braid" in reasons["strand_jamming"]
    assert "several actuators" in reasons["block_tilt"]


def test_one_sample_alone_is_compared_with_none(whole):
    one = whole[whole["sample"] == 3]
    _, out, _ = candidates(build_model("continuum"), [], one.columns, rows_of(one))
    reasons = {entry["effect"]: entry["reason"] for entry in out}
    for name in ("wall_modulus", "fiber_modulus"):
        assert "needs several samples" in reasons[name]


def test_without_falling_pressure_friction_cannot_be_tested(whole):
    rising = whole[whole["step"] < 8]
    names, out, _ = candidates(build_model("continuum"), [], rising.columns, rows_of(rising))
    assert "friction_hysteresis" not in names
    (entry,) = [c for c in out if c["effect"] == "friction_hysteresis"]
    assert entry["status"] == "not_testable"
    assert "falling" in entry["reason"]
    # What is given is not tested, and so has no entry.
    names, out, _ = candidates(build_model("continuum"), ["friction_hysteresis"], rising.columns, rows_of(rising))
    assert "friction_hysteresis" not in {*names, *(c["effect"] for c in out)}


def test_with_one_reading_a_state_relaxation_cannot_be_tested(whole):
    assert "read later" in unseen("relaxation", (), rows_of(whole[whole["step"] == 3]))


def test_where_the_pressure_rises_step_by_step_relaxation_cannot_be_told_from_what_goes_with_it(whole):
    """Of such a table of two braids whose length at rest was stated 2 % too short a search once named relaxation."""
    rising = whole[whole["step"] < 8]
    assert "goes with the pressure" in unseen("relaxation", (), rows_of(rising))
    # Readings err, pauses differ: this tells nothing yet.
    unsteady = np.random.default_rng(2)
    errs = rising.assign(
        pressure_kpa=rising["pressure_kpa"] + unsteady.normal(0, 0.5, len(rising)),
        time_s=rising["time_s"] + unsteady.uniform(0, 2, len(rising)),
    )
    assert "goes with the pressure" in unseen("relaxation", (), rows_of(errs))
    # A falling row, or states that were filled three times as slowly, do.
    assert not unseen("relaxation", (), rows_of(whole))
    place = rising["elongation_mm"].to_numpy()
    first = rising.groupby((rising["step"] == 0).cumsum())["time_s"].transform("min")
    slower = np.where(place > 0, 3.0, 1.0) * (rising["time_s"] - first)
    clock = first + slower + 1000.0 * np.cumsum(rising["step"].to_numpy() == 0)
    assert not unseen("relaxation", (), rows_of(rising.assign(time_s=clock)))


def test_with_ever_harsher_states_softening_cannot_be_tested(whole):
    data = whole[(whole["step"] == 0) & (whole["sample"] == 3)]
    states = States.from_table(data)
    order = np.argsort(states.severity.numpy())
    assert "milder" in unseen("stress_softening", (), rows_of(data.iloc[order].reset_index(drop=True)))
    assert not unseen("stress_softening", (), rows_of(data.iloc[order[::-1]].reset_index(drop=True)))


def test_assumed_seconds_are_told(whole):
    (note,) = assumptions(["force_gain", "sensor_drift"], whole.columns.drop("time_s"))
    assert "20 s" in note
    assert not assumptions(["sensor_drift"], whole.columns)
    assert not assumptions(["force_gain"], whole.columns.drop("time_s"))
