"""Effects that stretches of the session agree on, and errors that go on from row to row."""

import numpy as np
import pytest
import torch
from hidden_tables import table

from freelearn.data.rows import Rows
from freelearn.discovery.search.throughout import sigmas, stretches

ROWS, STRETCH = 320, 20


def wandering(generator, alike):
    """Errors (ROWS, 2) of variance one, of which each is like the one before by so much."""
    white = generator.standard_normal((ROWS, 2))
    errors = white.copy()
    for row in range(1, ROWS):
        errors[row] = alike * errors[row - 1] + np.sqrt(1 - alike**2) * white[row]
    return errors


def asked(errors, shape):
    """What is said of a shape (ROWS, 2) fitted to errors."""
    size = (shape * errors).sum() / (shape**2).sum()
    fewer, final = torch.as_tensor(errors), torch.as_tensor(errors - size * shape)
    return sigmas(fewer, final, torch.arange(ROWS) // STRETCH, 1)


def slow(generator):
    """A shape that hardly differs from row to row."""
    return np.cumsum(generator.standard_normal((ROWS, 2)), axis=0)


def test_of_independent_errors_stretches_say_as_much_as_rows():
    generator = np.random.default_rng(0)
    ratios = []
    for _ in range(60):
        shape = generator.standard_normal((ROWS, 2))
        alone, errors, needed = asked(generator.standard_normal((ROWS, 2)) + shape, shape)
        assert errors > needed
        ratios.append(errors / alone)
    # With 16 stretches an error is known to a fifth or so.
    assert np.median(ratios) == pytest.approx(1.0, abs=0.1)


def test_what_wanders_is_no_effect_however_sure_single_rows_are_of_it():
    generator = np.random.default_rng(1)
    told = np.array([asked(wandering(generator, 0.95), slow(generator)) for _ in range(200)])
    sure = told[:, 0] > 4
    assert sure.sum() > 30
    # Asked at a chance of 0.002 of errors that stretches do not share; over their ends a little goes on.
    assert (told[sure, 1] > told[sure, 2]).mean() < 0.1


def test_what_one_stretch_alone_shows_is_not_judged_by_how_they_differ():
    shape = np.zeros((ROWS, 2))
    shape[:STRETCH] = 5.0
    alone, errors, needed = asked(np.random.default_rng(2).standard_normal((ROWS, 2)) + shape, shape)
    assert alone > 10
    assert errors > needed


@pytest.mark.parametrize(("samples", "most"), [((3,), 16), ((3, 6), 8), ((1, 2, 3, 4, 5, 6), 4)])
def test_stretches_are_of_whole_visits_of_one_sample_each(samples, most):
    rows = Rows.from_table(table({}, samples=samples))
    number = stretches(rows).numpy()
    sample, state = rows.states.sample.numpy(), rows.state
    for one in np.unique(number):
        assert len(np.unique(sample[number == one])) == 1
    for one in np.unique(state):
        assert len(np.unique(number[state == one])) == 1
    assert len(np.unique(number)) == most * len(samples)
    assert (np.diff(number) >= 0).all()
