"""Rubber stretched in two directions at once: fits, held-out modes and missing energies, on exact and on real data."""

import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from closed_forms import synthetic

from freelearn.api.tasks.specimens_task import compared_specimens
from freelearn.data.specimen_table import Specimens, read_specimens
from freelearn.fitting.rubber_effects import asked_for, compare, conclusion, held_out_errors
from freelearn.fitting.rubber_fit import fit_rubber
from freelearn.physics.models.rubber import Rubber

ROOT = Path(__file__).resolve().parents[2]
MOONEY = (3e5, 4e4)


def mooney(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """P₁ [MPa] of C1/2 (I₁ − 3) + C01/2 (I₂ − 3), from true stresses: λ₁P₁ = C1 (λ₁² − λ₃²) − C01 (λ₁⁻² − λ₃⁻²)."""
    three = 1 / (one * two)
    C1, C01 = MOONEY
    return (C1 * (one**2 - three**2) - C01 * (one**-2 - three**-2)) / one / 1e6


def biaxial(seed: int = 0, count: int = 40) -> pd.DataFrame:
    """Exact biaxial tests of a Mooney rubber at random stretches."""
    one, two = np.random.default_rng(seed).uniform(1.0, 2.5, (2, count))
    table = {"stretch": one, "stretch_2": two, "stress_mpa": mooney(one, two), "stress_2_mpa": mooney(two, one)}
    return pd.DataFrame({"mode": "biaxial", "specimen": "", **table})


def test_fit_finds_the_parameters_of_exact_data():
    result = fit_rubber(Rubber(["second_invariant"]), biaxial())
    assert list(result.values.values()) == pytest.approx(MOONEY, rel=1e-6)
    assert result.modes["biaxial"].n == 80
    assert result.error < 1e-8


def test_a_stress_that_was_not_measured_has_no_say():
    table = biaxial()
    table.loc[::2, "stress_mpa"] = np.nan
    table.loc[1::2, "stress_2_mpa"] = np.nan
    result = fit_rubber(Rubber(["second_invariant"]), table)
    assert list(result.values.values()) == pytest.approx(MOONEY, rel=1e-6)
    assert result.modes["biaxial"].n == 40


def test_turning_the_sheet_changes_nothing():
    table = biaxial()
    table["stress_mpa"] *= 1 + 0.05 * np.random.default_rng(1).standard_normal(len(table))
    pairs = {"stretch": "stretch_2", "stress_mpa": "stress_2_mpa"}
    turned = table.rename(columns=pairs | {two: one for one, two in pairs.items()})
    results = [fit_rubber(Rubber(["second_invariant"]), t) for t in (table, turned)]
    assert results[0].values == pytest.approx(results[1].values, rel=1e-9)
    assert results[0].stderr == pytest.approx(results[1].stderr, rel=1e-6)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "pure_shear"])
def test_a_simple_mode_is_a_biaxial_one_with_its_stretch_across(mode):
    table = synthetic(3e5, 8e3)
    table["stress_mpa"] *= 1 + 0.05 * np.random.default_rng(0).standard_normal(len(table))
    own = table[table["mode"] == mode]
    named, general = (fit_rubber(Rubber(["wall_stiffening"]), t) for t in (own, own.assign(mode="biaxial")))
    assert general.values == named.values
    assert general.modes["biaxial"].error == named.modes[mode].error


@pytest.mark.nightly
def test_a_second_invariant_is_found_by_what_it_predicts():
    x = np.linspace(1.05, 2.5, 20)
    uniaxial = {"stretch": x, "stretch_2": x**-0.5, "stress_mpa": mooney(x, x**-0.5), "stress_2_mpa": np.nan}
    table = pd.concat([biaxial(), pd.DataFrame({"mode": "uniaxial", "specimen": "", **uniaxial})], ignore_index=True)
    table["stress_mpa"] *= 1 + 0.01 * np.random.default_rng(1).standard_normal(len(table))
    compared, _, effects = compared_specimens(Specimens(table, [], []))
    assert effects == ("second_invariant",)
    error = held_out_errors(compared)
    assert list(asked_for(error).index) == ["second_invariant"]
    assert error["second_invariant"] < 0.02 < 0.05 < error["neo-Hookean"]


@pytest.fixture(scope="module")
def converted(shared_data, tmp_path_factory):
    """The real tables by name, as the experiment converts them."""
    experiment = runpy.run_path(str(ROOT / "experiments/rubber_specimens.py"))
    folder = tmp_path_factory.mktemp("rubber")

    def table(name: str):
        path = folder / f"{Path(name).stem}.csv"
        experiment["MATERIALS"][name](shared_data / "rubber" / name).to_csv(path, index=False)
        return read_specimens([str(path)])

    return table


@pytest.mark.nightly
def test_james_rubber_asks_for_the_second_invariant(converted):
    data = converted("James_1975.csv")
    assert data.warnings == []
    compared = compare(data.table, data.modes)
    assert conclusion(compared).startswith("These tests ask for second_invariant")
    fitted = compared[(compared["held_out"] == "") & (compared["mode"] == "biaxial")].set_index("effects")["error"]
    assert fitted["neo-Hookean"] > 0.055
    assert fitted["second_invariant"] < 0.027


def test_a_series_that_is_another_ones_is_told(shared_data, tmp_path):
    raw = pd.read_csv(shared_data / "rubber/James_1975.csv")
    names = {"F11": "stretch", "F22": "stretch_2", "S11": "stress_mpa", "S22": "stress_2_mpa"}
    raw.rename(columns=names).assign(mode=raw["mode"].str[:2]).to_csv(tmp_path / "raw.csv", index=False)
    said = read_specimens([str(tmp_path / "raw.csv")]).warnings
    assert len(said) == 1
    assert "1 rows of mode biaxial are stretched alike in both directions" in said[0]


@pytest.mark.nightly
def test_the_gel_asks_for_the_second_invariant_and_a_stiffening(converted):
    data = converted("Katashima_2012.csv")
    assert data.modes == ["equibiaxial", "pure_shear", "biaxial"]
    assert data.warnings == []
    best = asked_for(held_out_errors(compare(data.table, data.modes)))
    assert all("second_invariant" in name for name in best.index)
    assert best.iloc[0] < 0.017


def test_the_latex_tube_is_a_soft_rubber_that_was_read_by_hand(converted):
    data = converted("latex_tube_elongation_2psi.csv")
    result = fit_rubber(Rubber(), data.table)
    # Latex has a shear modulus of a few hundred kPa; the readings creep and their zero jumps.
    assert 2e5 < result.values["C1"] < 3e5
    assert 0.1 < result.error < 0.14
