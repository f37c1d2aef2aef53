"""What to impose along a log: wishes are readings of logs by other code, and come back when predicted."""

import numpy as np
import pytest
from fitted_folders import continuum, fitted

from freelearn.common.errors import UserError
from freelearn.testing.reference.simulated_logs import C1, C2, UNIT, log

ASKED = ["sample", "time_s", "run", "elongation_mm", "twist_deg", "force_n"]
# kPa in the mean square by which straight lines differ from small steps; of a dead time the end is read by nobody.
WITHIN = {"creep": 0.05, "supply_lag": 0.05, "dead_time": 0.4, "contact_slip": 0.5}


@pytest.mark.parametrize("name", WITHIN)
def test_the_pressure_for_a_wished_force_is_that_which_made_it(name, tmp_path):
    effects = {name: UNIT[name]}
    run = fitted(tmp_path / "run", continuum(effects, C1, C2), log(effects, 1, recordings=3, noise=0.02))
    other = log(effects, 5, recordings=2, rate=20.0, seconds=8.0, noise=0.0)
    answers = run.invert(other[ASKED], bands=False)
    found = answers.frame()
    back = run.predict(found, bands=False).loads[:, 0]
    assert np.abs(back - other["force_n"]).max() < 2e-4 * other["force_n"].abs().max()
    assert ((found["pressure_kpa"] - other["pressure_kpa"]) ** 2).mean() ** 0.5 < WITHIN[name]
    assert answers.counts() == {"ok": len(other)}


def test_a_force_that_no_pressure_gives_is_marked_and_rows_out_of_order_are_refused(tmp_path):
    effects = {"creep": UNIT["creep"]}
    run = fitted(tmp_path / "run", continuum(effects, C1, C2), log(effects, 1, recordings=3, noise=0.02))
    other = log(effects, 5, recordings=1, noise=0.0)[ASKED]
    far = other.assign(force_n=np.where(other.index == 40, 10 * other["force_n"], other["force_n"]))
    table = run.invert(far, bands=False).frame()
    assert table["status"][40] == "unreachable"
    assert "the nearest makes force_n" in table["note"][40]
    assert (table["status"][1:30] == "ok").all()
    for asked in (run.invert, run.predict):
        with pytest.raises(UserError, match=r"Row 2, time_s: 19\.6 runs backwards in run 1, after"):
            asked(log(effects, 5, recordings=1, noise=0.0).iloc[::-1])
