"""What several tests need: the shared measurements, and random states of the paper's samples."""

import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.states import States
from freelearn.data.virtual import DESIGNS

ROOT = Path(__file__).resolve().parents[1]
# Helper modules (textbook, numpy_peer) lie beside the tests.
sys.path.insert(0, str(ROOT / "tests"))
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    folder = Path(os.environ.get("FREELEARN_SHARED_DATA", ROOT.parent / "shared/data"))
    if not folder.is_dir():
        pytest.skip(f"the shared measurements are not at {folder} (set FREELEARN_SHARED_DATA)")
    return folder


def random_table(count: int, seed: int) -> pd.DataFrame:
    """Rows at random states of the paper's samples, in the measurement table's format, loads zero."""
    generator = np.random.default_rng(seed)
    sample = generator.integers(0, len(DESIGNS), count)
    design = np.array(DESIGNS)[sample]
    return pd.DataFrame(
        {
            "sample": sample + 1,
            "gamma_deg": design[:, 0],
            "length_mm": design[:, 1],
            "inner_radius_mm": design[:, 2],
            "outer_radius_mm": design[:, 3],
            "step": 0,
            "elongation_mm": generator.uniform(-5, 5, count),
            "twist_deg": generator.uniform(-120, 120, count),
            "pressure_kpa": generator.uniform(0, 72.5, count),
            "force_n": 0.0,
            "moment_nmm": 0.0,
            "buckled": 0,
        }
    )


@pytest.fixture
def random_states():
    def make(count: int, seed: int = 0) -> States:
        return States.from_table(random_table(count, seed))

    return make
