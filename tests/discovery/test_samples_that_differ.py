"""Samples with rubber, or zeros, of their own: told by name, and not by what imitates them together."""

import numpy as np
import pandas as pd
import pytest

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.other_beds import measure, nominal

NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
# One is stiff: where it stands a little elsewhere its loads change by more than all that the others miss.
DESIGNS = {
    1: (27.5, np.nan, 86.9, 6.89, 8.97),
    2: (59.6, np.nan, 113.6, 3.03, 4.07),
    3: (63.1, np.nan, 105.0, 4.34, 6.03),
}
# What three samples of one rubber need together where each has its own, if none of the effects says so.
IMITATE = ["wall_thickness", "twist_slack", "fiber_misalignment", "end_taper", "pressure_gain", "stress_softening"]


def samples(c1, zeros):
    """Measured by the reference; c1: of each sample; zeros: of each, N and N·mm."""
    generator, parts = np.random.default_rng(4), []
    for (number, design), own, (force, moment) in zip(DESIGNS.items(), c1, zeros, strict=True):
        twist = 100 * min(1.0, design[2] / design[4] / 15.6)
        places = generator.uniform(-1, 1, (20, 2)) * (0.05 * design[2], twist)
        asked = nominal("kinematic", {number: design}, places.round(2), np.r_[0, 35, 70, 46, 23])
        part = measure("kinematic", asked, own, 2.4e7, {}, number, NOISE)
        shown = {"force_n": part["force_n"] + force, "moment_nmm": part["moment_nmm"] + moment}
        parts.append(part.assign(time_s=part["time_s"] + 1e4 * number, **shown))
    table = pd.concat(parts, ignore_index=True)
    return table[table["buckled"] == 0].reset_index(drop=True)


def found(table, library):
    def build(names):
        return build_model("continuum", {}, names, list(DESIGNS))

    return search(Question(build, library, Rows.from_table(table), Accuracy.engineering(**NOISE), 0))


def test_rubbers_of_their_own_are_not_walls_and_play_together():
    own = 1.45e6 * np.exp([0.0, -0.08, 0.13])
    result = found(samples(own, [(0, 0)] * 3), [*IMITATE, "wall_modulus"])
    assert (result.verdict, result.effects) == ("named", ["wall_modulus"])
    values = result.final.fit.values()
    told = [values[f"wall_modulus.log_ratio[{n}]"] for n in (2, 3)]
    assert told == pytest.approx([-0.08, 0.13], abs=0.01)


def test_zeros_of_their_own_are_offsets_of_each():
    zeros = [(0.4, -6.0), (-0.3, 5.0), (0.1, 3.0)]
    library = ["force_offset", "moment_offset", "force_gain", "length_offset", "twist_offset", "fiber_misalignment"]
    result = found(samples([1.45e6] * 3, zeros), library)
    assert set(result.effects) == {"force_offset", "moment_offset"}
    values = result.final.fit.values()
    for n, (force, moment) in zip(DESIGNS, zeros, strict=True):
        # Where the stiff one stands is known to 3 N, at twenty places.
        assert values[f"force_offset.force[{n}]"] == pytest.approx(force, abs=1.5 if n == 1 else 0.1)
        assert values[f"moment_offset.moment[{n}]"] == pytest.approx(moment * 1e-3, abs=6e-3 if n == 1 else 1e-3)


def test_of_one_rubber_nothing_differs():
    result = found(samples([1.45e6] * 3, [(0, 0)] * 3), ["wall_modulus", "fiber_modulus", "wall_thickness"])
    assert (result.verdict, result.effects) == ("adequate", [])
