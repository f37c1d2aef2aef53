"""Samples with rubber, zeros or gains of their own: told by name, and not by what imitates them together."""

import numpy as np
import pandas as pd
import pytest

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.laboratory import random_actuators
from freelearn.testing.reference.other_beds import measure, nominal

NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
C1, C2 = 1.455e6, 2.36e7
# Logarithms of C1 over the first one's: 8 % about their mean.
RUBBERS = (0.0, -0.0814, 0.1273)
# What three samples of one rubber need together where each has its own, if none of the effects says so.
IMITATE = ["wall_thickness", "twist_slack", "fiber_misalignment", "end_taper", "pressure_gain", "stress_softening"]


def samples(rubbers=(0.0, 0.0, 0.0), zeros=((0, 0),) * 3, gains=(0.0, 0.0, 0.0)):
    """Three actuators drawn at random, measured by the reference. rubbers: log-ratios of C1; zeros: N and N·mm; gains:
    of the force.

    The first is stiff: where it stands a little elsewhere its loads change by more than all that the others miss."""
    generator, parts = np.random.default_rng([4, 7]), []
    drawn = random_actuators(3, generator)
    # Where this was seen C1, C2 and the ratios were drawn here too.
    generator.random(2), generator.normal(size=3)
    for (number, design), ratio, (force, moment), gain in zip(drawn.items(), rubbers, zeros, gains, strict=True):
        gamma, length, inner, outer = design
        twist = 100 * min(1.0, length / outer / 15.6)
        places = np.stack([generator.uniform(-1, 1, 24) * 0.05 * length, generator.uniform(-1, 1, 24) * twist], axis=1)
        designs = {number: (gamma, np.nan, length, inner, outer)}
        asked = nominal("kinematic", designs, places.round(2), np.r_[0:71:17.5, 46, 23])
        part = measure("kinematic", asked, C1 * np.exp(ratio), C2, {}, 39 + number, NOISE)
        shown = {"force_n": part["force_n"] * (1 + gain) + force, "moment_nmm": part["moment_nmm"] + moment}
        parts.append(part.assign(time_s=part["time_s"] + 1e4 * number, **shown))
    table = pd.concat(parts, ignore_index=True)
    return table[table["buckled"] == 0].reset_index(drop=True)


def found(table, library):
    def build(names):
        return build_model("continuum", {}, names, [1, 2, 3])

    return search(Question(build, library, Rows.from_table(table), Accuracy.engineering(**NOISE), 0))


@pytest.mark.nightly
def test_rubbers_of_their_own_are_not_walls_and_play_together():
    # Before any doubt, in which the soft ones' misfit drowns.
    result = found(samples(RUBBERS), [*IMITATE, "wall_modulus"])
    assert (result.verdict, result.effects) == ("named", ["wall_modulus"])
    values = result.final.fit.values()
    told = [values[f"wall_modulus.log_ratio[{n}]"] for n in (2, 3)]
    assert told == pytest.approx(RUBBERS[1:], abs=0.01)


def test_zeros_of_their_own_are_offsets_of_each():
    zeros = [(0.4, -6.0), (-0.3, 5.0), (0.1, 3.0)]
    library = ["force_offset", "moment_offset", "force_gain", "length_offset", "twist_offset", "fiber_misalignment"]
    result = found(samples(zeros=zeros), library)
    assert set(result.effects) == {"force_offset", "moment_offset"}
    values = result.final.fit.values()
    for n, (force, moment) in enumerate(zeros, 1):
        # Where the stiff one stands is known to 3 N, at two dozen places.
        assert values[f"force_offset.force[{n}]"] == pytest.approx(force, abs=1.5 if n == 1 else 0.1)
        assert values[f"moment_offset.moment[{n}]"] == pytest.approx(moment * 1e-3, abs=6e-3 if n == 1 else 1e-3)


@pytest.mark.nightly
def test_gains_of_their_own_are_neither_rubber_nor_fibers():
    gains = (0.0, -0.03, 0.04)
    library = ["own_force_gain", "force_gain", "wall_modulus", "fiber_modulus", "fiber_misalignment", "pressure_gain"]
    result = found(samples(gains=gains), library)
    assert (result.verdict, result.effects) == ("named", ["own_force_gain"])
    values = result.final.fit.values()
    told = [values[f"own_force_gain.gain[{n}]"] for n in (2, 3)]
    assert told == pytest.approx(gains[1:], abs=0.01)


def test_of_one_rubber_nothing_differs():
    result = found(samples(), ["wall_modulus", "fiber_modulus", "wall_thickness"])
    assert (result.verdict, result.effects) == ("adequate", [])
