"""What a discovery says of a step."""

import numpy as np
import pytest
import torch
from first_step import first_step

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import simulate
from freelearn.records.discovery import sigmas_heldout, stderr


@pytest.fixture(scope="module")
def rows():
    data = settings(TrainSettings).data
    table = simulate(data.truth, {}, vars(data.accuracy), data.buckled_share, 3)
    chosen = np.flatnonzero((table["sample"] == 3) & (table["buckled"] == 0))[::20]
    table = table.iloc[chosen].reset_index(drop=True)
    return Rows.from_table(table)


def step_of(name: str, rows: Rows):
    return first_step(Question(lambda names: build_model(name, {}, names, [3]), [], rows, PAPER, 0))[1]


def test_a_model_without_physical_parameters_has_no_standard_errors(rows):
    """A network's weights are no quantities that anybody would tell."""
    torch.manual_seed(0)
    assert stderr(step_of("mlp", rows)) == {}


def test_held_out_residuals_of_a_right_model_are_noise(rows):
    step = step_of("continuum", rows)
    assert set(stderr(step)) == {"C1", "C2"}
    # A mean square of n whitened numbers scatters by √(2/n) about one; the scatter itself is estimated besides.
    assert sigmas_heldout(step) == pytest.approx(1, abs=4 * (2 / (2 * len(rows))) ** 0.5)
