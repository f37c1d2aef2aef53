"""All solutions of loads → place against a search that shares nothing with the package's: the textbook, and SciPy."""

import math

import numpy as np
import pandas as pd
import pytest
from fast_textbook import Tube
from fitted_folders import continuum, fitted, shown
from nightly import chosen
from scipy.integrate import quad
from scipy.optimize import root

from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.physics.simulated_bed import DESIGNS, protocol
from freelearn.testing.reference import textbook

SOFT = {"C1": 2e5, "C2": 1e6}
UNITS = np.array([MM, DEG])
HIGH = 51.785714
# Sample, place and pressure. Other places carry the loads of most, one near a fold among them; nothing stays under the
# last but one's, and the last has no other place.
ROWS = [(1, 0, 120, HIGH), (1, -2, 120, HIGH), (1, 0, 20, HIGH), (1, 3, 110, HIGH), (2, -5, -100, 0), (2, -3, -120, 0),
        (1, 4, -40, HIGH), (4, 4, 110, 0)]  # fmt: skip


def tube(sample, C1, C2):
    gamma, *sizes = DESIGNS[sample - 1]
    return Tube(gamma * DEG, *(size * MM for size in sizes), C1, C2)


def test_the_fast_textbook_is_the_textbook():
    generator = np.random.default_rng(1)
    for sample in (1, 4, 7):
        gamma, L, Ri, Ro = (v * f for v, f in zip(DESIGNS[sample - 1], (DEG, MM, MM, MM), strict=True))
        l, phi, P = L * generator.uniform(0.95, 1.05), generator.uniform(-2, 2), generator.uniform(1e3, 5e4)  # noqa: E741
        slow = textbook.continuum_row(gamma, L, Ri, Ro, l, phi, P, C1=8e5, C2=2e7)
        quick = tube(sample, 8e5, 2e7).loads(l, phi, P)[0]
        np.testing.assert_allclose(quick, slow[:2], rtol=1e-7, atol=1e-9)


@pytest.fixture(scope="module")
def soft(tmp_path_factory):
    model = continuum(c1=SOFT["C1"], c2=SOFT["C2"])
    table = shown(model, protocol().query("sample in (1, 2, 4)").iloc[::5].reset_index(drop=True))
    return fitted(tmp_path_factory.mktemp("soft"), model, table.dropna().reset_index(drop=True))


def asked(rows):
    """Questions for the places of rows whose loads the textbook says."""
    lines = []
    for sample, elongation, twist, pressure in rows:
        length = DESIGNS[sample - 1][1]
        force, moment = tube(sample, **SOFT).loads((length + elongation) * MM, twist * DEG, pressure * KPA)[0]
        lines.append((sample, pressure, force, moment / NMM))
    return pd.DataFrame(lines, columns=["sample", "pressure_kpa", "force_n", "moment_nmm"])


@pytest.fixture(scope="module")
def answers(soft):
    return soft.invert(asked(ROWS), bands=False)


def box(fitted, sample):
    """Span looked through, as docs/predict.md tells it: half as much again as the table went through."""
    table, length = fitted.table(), DESIGNS[sample - 1][1]
    shares = fitted.table()["elongation_mm"] / fitted.table()["length_mm"]
    room = 0.5 * (shares.max() - shares.min())
    low = min(shares.min() - room, -0.1), min(2 * table["twist_deg"].min(), -0.5 / DEG) * DEG
    high = max(shares.max() + room, 0.1), max(2 * table["twist_deg"].max(), 0.5 / DEG) * DEG
    return np.array([length * (1 + low[0]) * MM, low[1]]), np.array([length * (1 + high[0]) * MM, high[1]])


@pytest.mark.parametrize("i", chosen(range(len(ROWS)), 4))
def test_all_places_and_no_others_are_found(soft, answers, i):
    sample, elongation, twist, pressure = ROWS[i]
    of, question = tube(sample, **SOFT), asked(ROWS).iloc[i]
    loads = question[["force_n", "moment_nmm"]].to_numpy(float) * (1, NMM)
    there = of.places(loads, pressure * KPA, *box(soft, sample))
    # Each settled to the last digit by SciPy.
    there = [root(lambda x: (of.loads(*(x * UNITS), pressure * KPA)[0] - loads) / (1, NMM), p / UNITS) for p in there]
    truth = np.array([r.x for r in there]) - (DESIGNS[sample - 1][1], 0)
    assert answers.filled["solutions"][i] == len(truth)
    every = answers.every[answers.every["row"] == i] if len(truth) > 1 else answers.filled.iloc[[i]]
    every = every[["elongation_mm", "twist_deg"]].to_numpy(float)
    every, truth = every[every[:, 1].argsort()], truth[truth[:, 1].argsort()]
    np.testing.assert_allclose(every, truth, rtol=0, atol=1e-6)
    # The place that the loads were computed at is among them.
    assert np.abs(every - (elongation, twist)).max(1).min() < 1e-7


def test_some_of_these_rows_have_several_solutions(answers):
    assert (answers.filled["solutions"] > 1).sum() >= 4


def test_what_stays_is_a_minimum_of_the_energy(answers):
    """The Hessian of stored energy less the work of loads and fluid: minus the loads' derivatives at fixed pressure."""
    for _, row in answers.every.iterrows():
        sample = ROWS[int(row["row"])][0]
        length = (DESIGNS[sample - 1][1] + row["elongation_mm"]) * MM
        place = length, row["twist_deg"] * DEG
        slopes = tube(sample, **SOFT).slopes(*place, row["pressure_kpa"] * KPA)[0]
        np.testing.assert_allclose(slopes, slopes.T, rtol=1e-3, atol=1e-3)
        assert bool(row["stable"]) == stays(tube(sample, **SOFT), place, row["pressure_kpa"] * KPA)
    assert set(answers.every["stable"]) == {0, 1}


def test_the_loads_are_the_slopes_of_the_energy():
    """So that the test before means what it says: at no pressure, W from the invariants by SciPy's quadrature."""
    gamma, L, Ri, Ro = (v * f for v, f in zip(DESIGNS[3], (DEG, MM, MM, MM), strict=True))
    of = tube(4, **SOFT)

    def energy(length, twist):
        ri = float(of.radius(np.array([length]), np.array([twist]), np.zeros(1))[0])
        stretch, turn = length / L, twist / L

        def density(R):
            r = math.sqrt(ri**2 + (R**2 - Ri**2) / stretch)
            hoop = r / R
            i1 = 1 / (hoop * stretch) ** 2 + hoop**2 + (r * turn) ** 2 + stretch**2
            across = hoop * math.sin(gamma) + r * turn * math.cos(gamma)
            i4 = across**2 + (stretch * math.cos(gamma)) ** 2
            # Ψ = C1/2 (I₁ − 3) + C2/2 (I₄ − 1)², whose slope by I₄ is the textbook's C2 (I₄ − 1).
            return (SOFT["C1"] / 2 * (i1 - 3) + SOFT["C2"] / 2 * (i4 - 1) ** 2) * 2 * math.pi * R * L

        return quad(density, Ri, Ro, epsabs=1e-14, epsrel=1e-12)[0]

    length, twist, dl, dt = 1.02 * L, 0.6, 1e-5 * L, 1e-4
    by_length = (energy(length + dl, twist) - energy(length - dl, twist)) / (2 * dl)
    by_twist = (energy(length, twist + dt) - energy(length, twist - dt)) / (2 * dt)
    np.testing.assert_allclose(of.loads(length, twist, 0.0)[0], [-by_length, -by_twist], rtol=1e-5)


def stays(of, place, pressure):
    """Whether the energy's Hessian is positive definite, in units in which its entries are alike."""
    slopes = of.slopes(*place, pressure)[0] * np.outer((1, 1 / NMM), UNITS)
    return slopes[0, 0] < 0 and np.linalg.det(slopes) > 0
