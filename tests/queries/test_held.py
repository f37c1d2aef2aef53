"""What a bed never moved need not be said in a question: it is held where it was."""

import numpy as np
import pandas as pd
import pytest
from fitted_folders import continuum, design, fitted, shown

from freelearn import UserError
from freelearn.queries.asked_rows import with_held

SENSED = ["elongation_mm", "pressure_kpa"]


@pytest.fixture(scope="module")
def muscle(tmp_path_factory):
    """A run whose table was never twisted, and says nothing of moments."""
    model, generator = continuum(), np.random.default_rng(1)
    table = pd.DataFrame({"elongation_mm": np.repeat(np.linspace(-4, 4, 6), 8), "twist_deg": 0.0})
    table = table.assign(pressure_kpa=generator.uniform(5, 70, 48), **design(3), buckled=0, step=np.arange(48) % 8)
    table = shown(model, table).assign(moment_nmm=np.nan)
    table["force_n"] += 0.02 * generator.normal(size=48)
    return fitted(tmp_path_factory.mktemp("muscle"), model, table)


@pytest.fixture
def asked():
    return pd.DataFrame({"elongation_mm": [-2.0, 1.0, 3.0], "pressure_kpa": [20.0, 40.0, 60.0]})


def test_loads_are_told_without_a_twist(muscle, asked):
    plain = muscle.predict(asked).table()
    pd.testing.assert_frame_equal(plain, muscle.predict(asked.assign(twist_deg=0.0)).table())
    assert plain["force_pred_n"].notna().all()
    filled = muscle.invert(asked).filled
    np.testing.assert_allclose(filled["force_n"], plain["force_pred_n"], rtol=1e-12)
    assert (filled["twist_deg"] == 0).all()


def test_the_length_at_a_load_and_the_pressure_for_it_come_back(muscle, asked):
    force = muscle.predict(asked)["force_pred_n"].to_numpy()
    for lost in SENSED:
        back = muscle.invert(asked.assign(force_n=force).drop(columns=lost)).filled
        assert (back["status"] == "ok").all()
        np.testing.assert_allclose(back[lost], asked[lost], rtol=1e-6)


def test_what_is_asked_for_with_both_loads_is_not_held(muscle, asked):
    """A free end turns as it likes: it is blank because it is asked for."""
    free = muscle.invert(asked[["pressure_kpa"]].assign(force_n=0.0, moment_nmm=0.0)).filled
    assert (free["twist_deg"].abs() > 0.1).all()
    # A twist that is said stays, in the rows that say one.
    some = muscle.invert(asked.assign(twist_deg=[np.nan, 5.0, np.nan])).filled
    assert some["twist_deg"].tolist() == [0.0, 5.0, 0.0]


def test_what_was_moved_has_to_be_said(muscle, asked):
    with pytest.raises(UserError, match="elongation_mm"):
        muscle.predict(asked.drop(columns="elongation_mm"))
    left = muscle.invert(asked.drop(columns="elongation_mm")).filled
    assert (left["status"] == "unanswered").all()
    with pytest.raises(UserError, match="2 times"):
        muscle.predict(pd.concat([asked, asked[["pressure_kpa"]]], axis=1))


def test_of_a_hung_tube_the_moment_is_held():
    known = pd.DataFrame(
        {
            "bed": "dead_load",
            "force_n": [1.0, 2.0],
            "moment_nmm": 0.0,
            "elongation_mm": [1.0, 2.0],
            "twist_deg": [3.0, 4.0],
        }
    )
    asked = pd.DataFrame({"force_n": [1.5], "pressure_kpa": [30.0]})
    assert with_held(asked, known, loads=False)["moment_nmm"].tolist() == [0.0]
    assert "force_n" not in with_held(asked[["pressure_kpa"]], known, loads=True)
