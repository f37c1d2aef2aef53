"""A raw log becomes a row for each place where the bed stood still, with how well it is known."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from raw_files import HEADER, RECIPE, taken

from freelearn.data.intake.plateaus import find_plateaus


def log(levels, stay=40, ramp=6, noise=0.05, seed=0):
    """The pressure of a bed that stays at each level and ramps between them, and the level of each reading."""
    generator = np.random.default_rng(seed)
    pressure, level = [], []
    for number, (value, following) in enumerate(zip(levels, [*levels[1:], levels[-1]], strict=True)):
        pressure += [value] * stay + list(np.linspace(value, following, ramp + 2)[1:-1])
        level += [number] * stay + [-1] * ramp
    pressure, level = np.array(pressure)[:-ramp], np.array(level)[:-ramp]
    return pressure + noise * generator.uniform(-1, 1, len(pressure)), level


def test_a_log_is_averaged_with_its_standard_error(tmp_path):
    pressure, level = log([0.0, 30, 60, 30, 0])
    generator = np.random.default_rng(1)
    force = -0.1 * pressure + generator.normal(0, 0.2, len(pressure))
    text = (
        HEADER
        + "\n"
        + "\n".join(
            f"{i / 4},0,0,{p:.5f},{f:.5f},{-f:.5f}" for i, (p, f) in enumerate(zip(pressure, force, strict=True))
        )
    )
    recipe = RECIPE + "plateaus: {of: {pressure_kpa: 1}, settle: 3, least: 10}\n"
    table, _ = taken(tmp_path, text, recipe)
    assert len(table) == 5
    assert table["step"].tolist() == [0, 1, 2, 3, 4]
    assert table["n_readings"].tolist() == [37] * 5
    np.testing.assert_allclose(table["pressure_kpa"], [0, 30, 60, 30, 0], atol=0.05)
    for row, (mean, error) in enumerate(zip(table["force_n"], table["force_se_n"], strict=True)):
        part = force[level == row][3:]
        assert mean == pytest.approx(part.mean(), abs=1e-5)
        assert error == pytest.approx(part.std(ddof=1) / np.sqrt(37), abs=1e-5)
    assert table["force_se_n"].mean() == pytest.approx(0.2 / np.sqrt(37), rel=0.3)


@given(
    st.lists(st.integers(0, 8), min_size=1, max_size=8).filter(lambda x: all(a != b for a, b in pairwise(x))),
    st.integers(12, 40),
    st.integers(0, 1000),
)
def test_plateaus_are_found_wherever_the_bed_stays(levels, stay, seed):
    pressure, level = log([10.0 * x for x in levels], stay=stay, ramp=4, noise=0.2, seed=seed)
    found = find_plateaus({"p": pressure}, {"p": 1.0}, 8)
    assert found.max() + 1 == len(levels)
    assert (found[level >= 0] == level[level >= 0]).all()
    assert (found[level < 0] == -1).all()


def test_a_jump_without_a_ramp_parts_two_plateaus():
    found = find_plateaus({"p": np.repeat([0.0, 5.0, 5.1], 6)}, {"p": 1.0}, 4)
    assert found.tolist() == [0] * 6 + [1] * 12


def test_a_ramp_has_none():
    assert (find_plateaus({"p": np.linspace(0, 100, 200)}, {"p": 1.0}, 5) == -1).all()
    assert (find_plateaus({"p": np.zeros(3)}, {"p": 1.0}, 5) == -1).all()
