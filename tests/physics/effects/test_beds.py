"""On which beds an effect can be told, and what is said where it cannot."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.common.errors import UserError
from freelearn.data.beds import BED, BEDS
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.search.testable import candidates
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH, labels_of
from freelearn.testing.small_tables import visits

HISTORY = {name for name, kind in EFFECTS.items() if kind.port == "history"}
# Which effects are refused where.
REFUSED = {
    "kinematic": {"buckling"},
    "isometric": {"moment_offset", "moment_gain", "own_moment_gain"},
    "dead_load": {"twist_slack", "viscoelasticity", "motion_friction", "maxwell_slip", "contact_slip", "buckling"},
    "inflation": {"moment_offset", "moment_gain", "own_moment_gain", "buckling", *HISTORY},
}
READINGS = ("force_n", "moment_nmm", "elongation_mm", "twist_deg", "outer_diameter_mm")


def table(name: str) -> pd.DataFrame:
    """A small table of the bed; its readings are of no interest."""
    frame = visits(count=3).assign(buckled=0, **{BED: name})
    if name == "dead_load":
        hung = np.random.default_rng(0).uniform(-1, 1, 6).repeat(4)
        frame = frame.drop(columns=["elongation_mm", "twist_deg"]).assign(force_n=hung, moment_nmm=40 * hung[::-1])
        frame["pressure_kpa"] /= 2
    return frame.assign(**{c: 0.0 for c in READINGS if c not in frame})


@pytest.mark.parametrize("bed", BEDS)
def test_each_bed_refuses_what_it_cannot_tell(bed):
    assert {name for name, kind in EFFECTS.items() if kind.untold(bed)} == REFUSED[bed]


@pytest.mark.parametrize("bed", BEDS)
@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_shows_on_every_bed_that_it_names(name, bed):
    """Its readings are finite and settled, and it moves some of those that the bed has."""
    if EFFECTS[name].untold(bed):
        return
    frame = table(bed)
    if name in HISTORY:
        frame = frame.assign(run=frame["sample"], time_s=np.arange(len(frame), dtype=float))
    # Strands that touch at rest already, of a braid that nothing pulls long here.
    close = {"strand_jamming.room": 0.0} if name == "strand_jamming" else {}
    states = States.from_table(frame)
    with torch.no_grad():
        bare = build_model("continuum", TRUTH["continuum"])(states)
        shown = build_model("continuum", TRUTH["continuum"] | labels_of(name, "scale") | close, [name])(states)
    assert (bare.status == 0).all()
    assert (shown.status == 0).all()
    there = [i for i, quantity in enumerate(BEDS[bed].readings) if quantity in BEDS[bed].measured]
    assert ((shown.loads - bare.loads)[:, there].abs() > 1e-9).any()


def test_the_search_says_on_which_beds_it_could_be_told():
    frame = table("dead_load")
    names, out, _ = candidates(build_model("continuum"), [], frame.columns, Rows.from_table(frame))
    assert "twist_slack" not in names
    (entry,) = [c for c in out if c["effect"] == "twist_slack"]
    assert entry["status"] == "not_testable"
    assert "dead_load" in entry["reason"]
    assert "kinematic" in entry["reason"]


def test_a_model_with_an_effect_that_the_bed_cannot_tell_is_refused():
    model = build_model("continuum", {}, ["twist_slack"])
    with pytest.raises(UserError, match="'twist_slack' cannot be told on the bed dead_load: it can on kinematic"):
        check_effects(model.effects, model.values(), States.from_table(table("dead_load")))
    check_effects(model.effects, model.values(), States.from_table(table("isometric")))


def test_beds_that_do_not_exist_are_refused():
    odd = type("Odd", (EFFECTS["force_offset"],), {"beds": ("moon",)})
    assert "must name beds" in odd.problem()


def test_friction_under_pressure_needs_falling_pressure():
    frame = visits(count=20)
    rising = frame[frame["step"] < 3].assign(buckled=0, force_n=0.0, moment_nmm=0.0)
    _, out, _ = candidates(build_model("continuum"), [], rising.columns, Rows.from_table(rising))
    assert {c["effect"] for c in out} >= {"contact_friction", "friction_hysteresis"}


def braids(elongation: float) -> Rows:
    frame = visits(count=5).assign(gamma_deg=30.0, gamma2_deg=-30.0, buckled=0, force_n=0.0, moment_nmm=0.0)
    return Rows.from_table(frame.assign(elongation_mm=elongation, twist_deg=0.0))


def test_only_braids_are_asked_for_a_slack_bladder_and_for_strands_that_touch_where_they_come_closer():
    def told(rows: Rows) -> set[str]:
        names = candidates(build_model("continuum"), [], visits().columns, rows).names
        return {"bladder_slack", "strand_jamming"} & set(names)

    single = visits(count=5).assign(buckled=0, force_n=0.0, moment_nmm=0.0)
    assert told(Rows.from_table(single)) == set()
    assert told(braids(-3.0)) == {"bladder_slack"}
    assert told(braids(4.0)) == {"bladder_slack", "strand_jamming"}
