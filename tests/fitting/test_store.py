"""Fits kept on disk: what makes them the same, and what happens to damaged files."""

import dataclasses

import numpy as np
import pytest
import torch

from freelearn.data.rows import Rows
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.store import FitStore, fit_key, timed
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.models.build import build_model

OPTIONS = FitOptions("levenberg_marquardt", max_epochs=50, restarts=1, patience=6)


@pytest.fixture
def rows(random_states):
    states = random_states(30)
    generator = torch.Generator().manual_seed(0)
    loads = torch.randn(30, 2, dtype=torch.float64, generator=generator)
    return Rows.whole(states, loads, np.arange(30) // 3)


def compute(model, rows):
    def fitted():
        outcome = fit(model, rows, rows[torch.arange(0)], OPTIONS, 0)
        return outcome, uncertainty(Problem(model, rows[torch.as_tensor(outcome.kept)]))

    return lambda: timed(fitted)


def refuse():
    raise AssertionError("the fit was computed again")


def test_a_kept_fit_is_read_back_whole(rows, tmp_path):
    store, model = FitStore(tmp_path), build_model("linear")
    first = store.fitted(model, "key", compute(model, rows))
    other = build_model("linear")
    again = store.fitted(other, "key", refuse)
    assert not first.reused
    assert again.reused
    torch.testing.assert_close(other.vector(), model.vector(), rtol=0, atol=0)
    for name in ("values", "stderr", "stderr_independent", "covariance"):
        np.testing.assert_array_equal(getattr(again.uncertainty, name), getattr(first.uncertainty, name))
    assert again.uncertainty.names == first.uncertainty.names
    assert again.outcome.history == first.outcome.history
    np.testing.assert_array_equal(again.outcome.kept, first.outcome.kept)


@pytest.mark.parametrize("content", [b"", b"no fit at all", b"PK\x03\x04 cut off"])
def test_a_damaged_file_is_fitted_again_and_replaced(content, rows, tmp_path):
    store, model = FitStore(tmp_path), build_model("linear")
    (tmp_path / "key.fit").write_bytes(content)
    assert not store.fitted(model, "key", compute(model, rows)).reused
    assert store.fitted(build_model("linear"), "key", refuse).reused


def test_the_key_depends_on_everything_that_the_numbers_do(rows):
    empty = rows[torch.arange(0)]

    def key(name="linear", effects=(), values=None, train=rows, options=OPTIONS, seed=0):
        return fit_key(build_model(name, values, effects), train, empty, options, seed)

    moved = Rows.whole(rows.states.replace(pressure=rows.states.pressure * (1 + 1e-12)), rows.loads, rows.state)
    grouped = Rows.whole(rows.states, rows.loads, np.arange(30) // 5)
    keys = [
        key(),
        key("continuum"),
        key(effects=["twist_offset"]),
        key(values={"ka": 2.0}),
        key(train=moved),
        key(train=rows[torch.arange(29)]),
        key(train=grouped),
        key(options=dataclasses.replace(OPTIONS, max_epochs=51)),
        key(seed=1),
    ]
    assert len(set(keys)) == len(keys)
    # How the states are numbered does not matter, only which rows share one.
    assert key(train=Rows.whole(rows.states, rows.loads, rows.state + 7)) == keys[0]
