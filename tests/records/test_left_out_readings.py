"""What fits say of readings that they did not see, and the bands and intervals that go by it."""

import math

import numpy as np
import pandas as pd
import pytest
import torch
from face_runs import found_search
from first_step import first_step

from freelearn.common.package import EXAMPLES
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import ISOMETRIC
from freelearn.data.columns import usable_rows
from freelearn.data.rows import Rows
from freelearn.data.table.measurement_table import read_table
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.step import heldout_stderr, parameter_covariance
from freelearn.fitting.uncertainty import quantile
from freelearn.physics.models.build import build_model
from freelearn.queries.inverse.bands import Bands
from freelearn.records.discovery import reach, stderr
from freelearn.records.left_out_readings import LeftOutReadings

COLUMNS = {"force_heldout_n", "force_heldout_n_stderr", "moment_heldout_nmm", "moment_heldout_nmm_stderr"}
# Of a search on six lengths of a muscle: as many parameters as lengths and one more.
SEVERAL = ["small_strain_stiffness", "end_taper", "length_offset", "pressure_gain"]


@pytest.fixture(scope="module")
def muscle():
    """A search's step on six lengths of a pneumatic muscle, and its rows."""
    table = read_table(EXAMPLES / "dmsp_20_300.csv", ISOMETRIC).table
    table = table[usable_rows(table)].reset_index(drop=True)
    rows, errors = Rows.from_table(table), Accuracy.engineering(0.3, 0.175, 1.0, 3.0, 0.6)
    question = Question(lambda names: build_model("continuum", {}, names), [], rows, errors, 0, given=SEVERAL)
    prepared, step = first_step(question)
    assert len(np.unique(prepared.rows.state)) == 6
    return step, prepared.rows


def test_a_search_s_table_has_the_errors_that_it_tells():
    found = found_search()
    table = found.table()
    assert set(table) >= COLUMNS
    missed = LeftOutReadings.from_table(table).missed.numpy()
    largest = [np.abs(table["force_n"]).max(), np.abs(table["moment_nmm"]).max() / 1e3]
    # The paper's E, with what was measured beside what was said, from the file alone.
    error = np.sqrt(np.nanmean((missed / largest) ** 2, axis=0).sum())
    assert error == pytest.approx(found.content["trail"][-1]["E_heldout"], rel=0.02)
    again = LeftOutReadings.from_table(table).of(np.arange(5))
    np.testing.assert_allclose(again.missed[:, 0], (table["force_heldout_n"] - table["force_n"])[:5], rtol=1e-9)


def test_who_did_not_see_a_state_knows_less_of_it():
    found = found_search()
    table = found.table().dropna(subset=["force_heldout_n_stderr"])
    own = found.predict(table, bands=False).table()
    for load in ("force_{}_n_stderr", "moment_{}_nmm_stderr"):
        assert (table[load.format("heldout")].to_numpy() >= own[load.format("pred")].to_numpy() * 0.999).all()


def test_a_table_without_these_columns_tells_nothing():
    table = found_search().table().drop(columns="force_heldout_n").drop(columns="moment_heldout_nmm_stderr")
    assert LeftOutReadings.from_table(table) is None


def test_bands_of_few_lengths_are_about_as_wide_as_the_fit_misses(muscle):
    """A length that was left out at the end is missed by a hundred newtons where nothing is known of the rubber: no
    measure of those between, of which the fit knows more."""
    step, rows = muscle
    everything, known = torch.ones(len(rows), dtype=torch.bool), parameter_covariance(step).numpy()
    present = rows.readings.present[:, 0].numpy()
    missed = np.abs(step.fit.raw_residual[:, 0].numpy()[present])
    for left in (LeftOutReadings.from_step(step, rows), None):
        bands = Bands.from_model(step.fit.model, rows, everything, known, None, left=left)
        half = bands.half(rows.states, step.fit.shown)[present, 0]
        assert (missed <= half).mean() > 0.9
        assert np.median(half) < 3 * np.sqrt(np.mean(missed**2))


def test_errors_and_intervals_heed_what_was_known_beforehand(muscle):
    step, rows = muscle
    states = len(np.unique(rows.state))
    prior = step.fit.prior.covariance.diagonal().sqrt()
    labels, far, error = step.fit.model.labels(), reach(step, states), stderr(step)
    for i, (label, declared) in enumerate(step.fit.model.declared.items()):
        assert labels[i] == label
        unit = step.fit.values()[label] if declared.log else 1.0
        assert error[label] <= float(prior[i]) * unit * (1 + 1e-6)
        # Wider than by the normal quantile, for few lengths tell how large errors are; no wider than known beforehand.
        assert quantile(math.inf) * error[label] <= far[label] * (1 + 1e-6)
        assert far[label] <= min(quantile(1) * error[label], quantile(math.inf) * float(prior[i]) * unit) * (1 + 1e-6)
    # With many states both are the same.
    many = reach(step, 10**6)
    assert {k: many[k] for k in many} == pytest.approx({k: quantile(math.inf) * error[k] for k in error}, rel=1e-4)


def test_the_standard_error_of_what_was_left_out_is_the_posterior_s(muscle):
    """By Gauss's formula on the rows of the other lengths, in NumPy."""
    step, _ = muscle
    fold = step.heldout.fold
    own = fold == fold[0]
    known = step.fit.jacobian[torch.as_tensor(~own)].flatten(0, 1).numpy() / step.left.scale
    root = step.fit.prior.root.numpy()
    inverse = np.linalg.inv(known.T @ known * step.whiten.efficiency + root.T @ root)
    by = step.fit.raw_jacobian[torch.as_tensor(own), 0].numpy()
    expected = np.sqrt(np.einsum("np,pq,nq->n", by, inverse, by))
    np.testing.assert_allclose(heldout_stderr(step)[torch.as_tensor(own), 0], expected, rtol=1e-6)


def test_columns_stand_at_the_rows_that_were_looked_at(muscle):
    step, rows = muscle
    kept = np.zeros(len(rows) + 3, dtype=bool)
    kept[3:] = True
    columns = LeftOutReadings.from_step(step, rows).columns(rows, kept)
    # The muscle's moment was never measured.
    assert set(columns) == {"force_heldout_n", "force_heldout_n_stderr"}
    assert all(np.isnan(values[:3]).all() for values in columns.values())
    shown = pd.Series(columns["force_heldout_n"][3:])
    np.testing.assert_allclose(shown, (rows.readings.value + step.heldout.raw)[:, 0].numpy(), rtol=1e-12)
