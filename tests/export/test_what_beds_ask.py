"""An export answers what `predict` and `invert` of its run answer, whatever bed that was fitted on."""

import numpy as np
import pandas as pd
import pytest
import torch
from exported import run_of

from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.inverse import inverse
from freelearn.export.writers.c_file import compiler, run
from freelearn.export.writers.c_source import c_source

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def _library(fitted, folder, asked):
    """Those of its functions that are asked for by name, compiled: each takes seconds to trace."""
    functions = {f.name: f for f in asked(Functions(Actuator.from_fitted(fitted)))}
    (folder / "arm.c").write_text(c_source("arm", "arm", list(functions.values())), encoding="utf-8")
    return functions, run(folder / "arm.c", "arm")


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hung")
    fitted = run_of(folder / "run", "continuum", "dead_load")
    return fitted, *_library(fitted, folder, lambda every: [f for view in every.views for f in view.parts])


@pytest.mark.nightly
def test_a_hung_run_answers_with_the_places_that_predict_gives(hung):
    fitted, functions, library = hung
    rows = fitted.table()
    # Each row for itself: nothing moved before.
    rows = rows[["sample", "force_n", "moment_nmm", "pressure_kpa"]].assign(step=0)
    answer = fitted.predict(rows)
    place = functions["place"]
    assert [p.name for p in place.inputs] == ["force", "moment", "pressure", "direction", "worst_severity"]
    blank = np.zeros((len(rows), 2))
    asked = np.c_[rows["force_n"], rows["moment_nmm"] * NMM, rows["pressure_kpa"] * KPA, blank]
    # Of a row by itself the worst severity is its own: none that was before matters.
    alone = [fitted.predict(rows.iloc[i : i + 1]) for i in range(0, len(rows), 5)]
    got, _ = library.answers(place, asked[::5])
    np.testing.assert_allclose(got[:, :2], np.concatenate([a.loads for a in alone]), rtol=0, atol=1e-11)
    assert got[:, 2].tolist() == [0.0] * len(got)
    assert np.ptp(answer.loads, axis=0).min() > 1e-3
    bands, _ = library.answers(functions["place_band"], asked[::5])
    np.testing.assert_allclose(bands[:, :2], np.concatenate([a.half for a in alone]), rtol=1e-6)


@pytest.mark.nightly
def test_compliances_are_differences_of_places(hung):
    _, functions, library = hung
    at = np.array([-0.5, 0.02, 2e4, 1.0, 0.3])
    rates, _ = library.answers(functions["compliance"], at[None])
    for k, step in enumerate((1e-4, 1e-6, 1.0)):
        beside = np.stack([at, at])
        beside[:, k] += [-step, step]
        places, _ = library.answers(functions["place"], beside)
        np.testing.assert_allclose(rates[0, [k, 3 + k]], (places[1] - places[0])[:2] / (2 * step), rtol=1e-6)


@pytest.mark.nightly
def test_a_load_that_nothing_carries_is_flagged(hung):
    _, functions, library = hung
    got, flags = library.answers(functions["place"], np.array([[0.0, 50.0, 0.0, 0.0, 0.0], [-0.5, 0.0, 0.0, 0.0, 0.0]]))
    assert got[:, 2].tolist() == [1.0, 0.0]
    assert flags.tolist() == [3, 0]


@pytest.mark.nightly
def test_a_place_under_loads_carries_them(hung):
    """The two questions of a hung run are each other's inverse."""
    _, functions, library = hung
    generator = np.random.default_rng(1)
    # Softened long ago, so that the state itself softens nothing.
    asked = np.c_[generator.uniform([-1, -0.09, 0], [0, 0.09, 3.6e4], size=(50, 3)), np.ones(50), np.full(50, 1e3)]
    places, _ = library.answers(functions["place"], asked)
    loads, _ = library.answers(functions["loads"], np.c_[places[:, :2], asked[:, 2:]])
    np.testing.assert_allclose(loads[:, :2], asked[:, :2], rtol=0, atol=1e-10)


@pytest.mark.nightly
def test_pressures_of_an_end_block_are_those_of_invert(tmp_path):
    fitted = run_of(tmp_path / "run", "continuum", "block")
    # Of both loads: those of one alone are looked for in the same way.
    functions, library = _library(fitted, tmp_path, lambda every: [inverse(every.loads.actuator, (0, 1))])
    generator = np.random.default_rng(0)
    state = generator.uniform([-2, -50, 5, 5, 5], [2, 50, 60, 60, 60], size=(12, 5))
    names = ["elongation_mm", "twist_deg", "pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa"]
    loads = np.stack([fitted.predict(pd.DataFrame([s], columns=names)).loads[0] for s in state])
    asked = pd.DataFrame(state, columns=names).assign(force_n=loads[:, 0], moment_nmm=loads[:, 1] / NMM)
    asked.loc[:, names[2:]] = np.nan
    told = fitted.invert(asked).table()
    assert (told["status"] == "ok").all()
    f = functions["pressures_for_loads"]
    given = np.c_[state[:, 0] * MM, state[:, 1] * DEG, loads, np.zeros((12, len(f.inputs) - 4))]
    got, _ = library.answers(f, given)
    assert got[:, 3].tolist() == [1.0] * 12
    # The least of them are taken by a small weight there, which moves them by so much.
    np.testing.assert_allclose(got[:, :3] / KPA, told[names[2:]], rtol=0, atol=2e-3)
    half = (told["pressure_1_kpa_high"] - told["pressure_1_kpa_low"]) / 2
    np.testing.assert_allclose(got[:, 5] / KPA, half, rtol=1e-3)


@pytest.mark.nightly
def test_an_inflated_run_answers_with_force_and_diameter(tmp_path):
    fitted = run_of(tmp_path / "run", "continuum", "inflation")
    functions, library = _library(fitted, tmp_path, lambda every: every.view.parts)
    rows = fitted.table()[["sample", "elongation_mm", "twist_deg", "pressure_kpa"]].iloc[::9].assign(step=0)
    want = np.concatenate([fitted.predict(rows.iloc[i : i + 1]).loads for i in range(len(rows))])
    state = np.c_[rows["elongation_mm"] * MM, rows["twist_deg"] * DEG, rows["pressure_kpa"] * KPA]
    f = functions["swelling"]
    assert [p.name for p in f.outputs[:2]] == ["force", "diameter"]
    got, _ = library.answers(f, np.c_[state, np.zeros((len(rows), len(f.inputs) - 3))])
    np.testing.assert_allclose(got[:, :2], want, rtol=0, atol=1e-9 * np.ptp(want, axis=0).min())
    assert torch.tensor(want[:, 1]).std() > 0
