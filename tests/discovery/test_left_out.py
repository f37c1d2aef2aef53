"""What is left out and fitted without."""

import numpy as np
import pytest
from first_step import first_step
from linear_bed import bench

from freelearn.discovery.fits.left_out import RUNS, folds_of, held_out, paired


def test_of_one_state_its_runs_are_compared():
    """A block under one load is one state, however many pressures it was read at: there is something to compare."""
    _, step = first_step(bench(1).question())
    fit, rows, whiten = step.fit, bench(1).rows, step.whiten
    one = np.zeros(len(rows), dtype=int)
    fold = folds_of(one, seed=0)
    left = held_out(fit, rows, whiten, fold, one)
    assert len(left.loss) == RUNS
    assert left.loss.sum() == pytest.approx(float(left.white.square().sum()))
    for run in range(RUNS):
        assert left.loss[run] == pytest.approx(float(left.white[fold == run].square().sum()))
    gain, error = paired(left, left)
    assert (gain, error) == (0.0, 0.0)
