"""The virtual bed: the paper's protocol, its noise, its buckling."""

import numpy as np
import pytest
import torch

from freelearn.data.rows import loads_of
from freelearn.data.states import States, kinematic_state
from freelearn.data.table.measurement_table import read_table
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.simulated_bed import simulate

ACCURACY = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
TRUTH = {"C1": 1e6, "C2": 2e7}


@pytest.fixture(scope="module")
def bed():
    return simulate(TRUTH, {}, ACCURACY, 0.45, seed=0)


def test_has_the_papers_configurations(bed):
    assert len(bed) == 22_880
    assert bed.groupby("sample").size().to_dict() == dict.fromkeys(range(1, 9), 2860)
    assert len(np.unique(kinematic_state(bed))) == 8 * 286
    direction = States.from_table(bed).direction.numpy().reshape(-1, 10)
    # Noise of the pressure sensor must not turn the direction around: steps are 10 kPa, noise 0.15 kPa.
    assert (direction == [0, 1, 1, 1, 1, 1, 1, 1, -1, -1]).all()


def test_a_seed_fixes_everything(bed):
    assert simulate(TRUTH, {}, ACCURACY, 0.45, seed=0).equals(bed)
    assert not simulate(TRUTH, {}, ACCURACY, 0.45, seed=1).equals(bed)


def test_buckles_in_the_papers_share_with_different_patterns(bed):
    assert bed["buckled"].mean() == pytest.approx(0.45, abs=0.005)
    pattern = bed["buckled"].to_numpy().reshape(8, 2860)
    agreement = np.corrcoef(pattern)[np.triu_indices(8, 1)]
    assert agreement.max() < 0.8
    assert (pattern.mean(1) > 0.1).all()
    assert (pattern.mean(1) < 0.9).all()


def test_noise_is_the_accuracy(bed):
    """With the truth known, what remains has the size that the accuracy and the model's own stiffness give."""
    quiet = simulate(TRUTH, {}, ACCURACY | {"elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": 0.0}, 0.45, seed=3)
    usable = quiet[quiet["buckled"] == 0]
    with torch.no_grad():
        rest = loads_of(usable) - Continuum(**TRUTH)(States.from_table(usable)).loads
    assert rest.std(0).tolist() == pytest.approx([0.03, 0.6e-3], rel=0.03)
    # A position error is shared by the rows of a state: at one state the residuals are nearly the same.
    shaky = simulate(TRUTH, {}, ACCURACY | {"force_n": 0.0, "moment_nmm": 0.0, "pressure_kpa": 0.0}, 0.0, seed=3)
    with torch.no_grad():
        rest = (loads_of(shaky) - Continuum(**TRUTH)(States.from_table(shaky)).loads)[:, 0].numpy()
    by_state = rest.reshape(-1, 10)
    within, between = by_state.std(1).mean(), by_state.mean(1).std()
    assert within < 0.2 * between


def test_is_a_valid_measurement_table(bed, tmp_path):
    bed.to_csv(tmp_path / "bed.csv", index=False)
    read = read_table(tmp_path / "bed.csv")
    assert len(read.table) == len(bed)
    assert read.warnings == []


def test_effects_change_the_loads_and_may_differ_between_samples(bed):
    rough = simulate(TRUTH, {"friction_hysteresis": {"force": [0, 5, 0, 0, 0, 0, 0, 0]}}, ACCURACY, 0.45, seed=0)
    change = (rough["force_n"] - bed["force_n"]).to_numpy()
    second = (bed["sample"] == 2).to_numpy()
    assert np.abs(change[~second]).max() == 0
    assert change[second].reshape(-1, 10)[0].round(9).tolist() == [0, -5, -5, -5, -5, -5, -5, -5, 5, 5]


def test_the_material_may_differ_between_samples(bed):
    soft = [1e6, 1e6, 1e6, 5e5, 1e6, 1e6, 1e6, 1e6]
    mixed = simulate({"C1": soft, "C2": 2e7}, {}, ACCURACY, 0.45, seed=0)
    whole = simulate({"C1": 5e5, "C2": 2e7}, {}, ACCURACY, 0.45, seed=0)
    fourth = (bed["sample"] == 4).to_numpy()
    loads = ["force_n", "moment_nmm"]
    assert mixed.loc[~fourth, loads].equals(bed.loc[~fourth, loads])
    assert mixed.loc[fourth, loads].equals(whole.loc[fourth, loads])
    assert not mixed.loc[fourth, loads].equals(bed.loc[fourth, loads])
