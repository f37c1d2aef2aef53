"""What to impose along a log: wishes are readings of logs by other code, and come back when predicted."""

import numpy as np
import pandas as pd
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


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["supply_lag", "contact_slip"])
def test_bands_along_a_log_are_as_wide_as_answers_to_noisy_wishes_scatter(name, tmp_path):
    """Nothing but the stated errors of measuring: each wish has those of its force, each recording those of its place,
    each pressure that is then read those of its gauge. A state that lasts would scatter less."""
    effects = {name: UNIT[name]}
    run = fitted(tmp_path / "run", continuum(effects, C1, C2), log(effects, 1, recordings=12))
    other = log(effects, 5, recordings=1, rate=10.0, seconds=6.0, noise=0.0)[ASKED]
    # In the middle of what was gone through: at its ends nothing scatters outwards.
    inner = slice(8, -3)
    told = run.invert(other).frame()
    half = ((told["pressure_kpa_high"] - told["pressure_kpa_low"]) / 2).to_numpy()
    factor = float(run.asker.miss.factors((2,), (0,), run.asker.scale)[0])
    # All of them at once, a recording each.
    generator, drawn = np.random.default_rng(0), []
    for number in range(60):
        place = {c: other[c] + generator.normal(0, σ) for c, σ in (("elongation_mm", 0.073), ("twist_deg", 0.175))}
        force = other["force_n"] + generator.normal(0, 0.03, len(other))
        drawn.append(other.assign(run=number, force_n=force, **place))
    found = run.invert(pd.concat(drawn, ignore_index=True), bands=False).frame()["pressure_kpa"].to_numpy()
    spread = np.std(found.reshape(60, -1) + generator.normal(0, 0.15, (60, len(other))), axis=0)
    middle = (other["force_n"].abs() > 0.15 * other["force_n"].abs().max()).to_numpy() & (
        told["status"] == "ok"
    ).to_numpy()
    ratio = (half / factor / spread)[inner][middle[inner]]
    assert len(ratio) > 15
    assert np.median(ratio) == pytest.approx(1.0, abs=0.15)
    assert np.quantile(ratio, 0.05) > 0.85
    assert np.quantile(ratio, 0.95) < 1.4
