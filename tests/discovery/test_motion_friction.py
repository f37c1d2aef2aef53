"""A muscle that is pulled and let go under one pressure after the other: its threads rub against the motion."""

from functools import cache

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.estimated_accuracy import repeat_rows
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import candidates, question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.total_energy import bed_loads, state_of

NOISE = {"elongation_mm": 0.03, "twist_deg": 0.1, "pressure_kpa": 0.15, "force_n": 0.05, "moment_nmm": 0.5}
TUBE = {"sample": 1, "gamma_deg": 30.0, "length_mm": 120.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.5}
FORTH = np.linspace(-6.0, 6.0, 9)
RUB = "motion_friction"


def swept(rub, places, seed=4):
    """Under each of five pressures through the places; rub [N] against each move, added here by hand."""
    generator = np.random.default_rng(seed)
    rows = [(p, e) for p in (0.0, 15.0, 30.0, 45.0, 60.0) for e in places]
    table = pd.DataFrame(rows, columns=["pressure_kpa", "elongation_mm"]).assign(**TUBE, twist_deg=20.0, step=0)
    table["time_s"] = 20.0 * np.arange(len(table))
    real = table.copy()
    for name in ("elongation_mm", "twist_deg"):
        real[name] += generator.normal(0, NOISE[name], len(real))
    loads, balanced = bed_loads(state_of(real), 4e5, 1e7, {})
    assert balanced.all()
    table["force_n"] = loads[:, 0] - rub * np.sign(table["elongation_mm"].diff().fillna(0.0))
    table["moment_nmm"] = loads[:, 1] * 1e3
    for name in ("pressure_kpa", "force_n", "moment_nmm"):
        table[name] += generator.normal(0, NOISE[name], len(table))
    return table.assign(buckled=0)


def build(names):
    return build_model("continuum", {}, names)


@cache
def searched(rub, back):
    table = swept(rub, np.r_[FORTH, FORTH[-2::-1]] if back else FORTH)
    return search(question_of_rows(build, table.columns, Rows.from_table(table), Accuracy.engineering(**NOISE), 0))


def test_friction_against_the_motion_is_named_and_as_large_as_it_is():
    found = searched(0.4, True)
    assert (found.verdict, found.effects) == ("named", [RUB])
    assert found.final.fit.values()[f"{RUB}.force"] == pytest.approx(0.4, rel=0.1)


def test_without_it_nothing_is_missing():
    assert searched(0.0, True).verdict == "adequate"


def test_sweeps_one_way_leave_it_undecided():
    """But for each sweep's first row, to which the bed came back, it is a zero of the force there: four rows tell."""
    found = searched(0.4, False)
    assert (found.verdict, found.effects) == ("undecided", [RUB])


def test_forth_and_back_are_no_repeats_of_each_other():
    """Else friction would pass for scatter: the table would be stopped for an accuracy that it has."""
    table = swept(0.4, np.r_[FORTH, FORTH[-2::-1]])
    assert repeat_rows(Rows.from_table(table)) == []
    found = fl.discover(table, accuracy=fl.Accuracy(**NOISE), progress=False)
    assert found.effects == [RUB]
    assert [check for check in found.content["checks"] if check["status"] == "fail"] == []
    # Nor are there steps to be counted: each row is a place of its own.
    assert not any("step is" in note.lower() for note in found.content["notes"])


def test_rows_whose_pressure_changes_do_not_ask_for_it():
    table = swept(0.0, FORTH)
    ladder = table.assign(
        step=np.arange(len(table)) % 5,
        elongation_mm=np.repeat(FORTH, 5),
        pressure_kpa=np.tile([0.0, 15.0, 30.0, 45.0, 60.0], 9),
    )
    _, untestable, unshown = candidates(build([]), [], ladder.columns, Rows.from_table(ladder))
    assert any(c["effect"] == RUB and "either way" in c["reason"] for c in untestable)
    assert RUB not in unshown
