"""What several tests need: the shared measurements, and random states of the paper's samples."""

import os
from pathlib import Path

import pytest
import torch

from freelearn.measurements.states import States
from freelearn.testing.tables import random_table

ROOT = Path(__file__).resolve().parents[1]
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    folder = Path(os.environ.get("FREELEARN_SHARED_DATA", ROOT.parent / "shared/data"))
    if not folder.is_dir():
        pytest.skip(f"the shared measurements are not at {folder} (set FREELEARN_SHARED_DATA)")
    return folder


@pytest.fixture
def random_states():
    def make(count: int, seed: int = 0) -> States:
        return States.from_table(random_table(count, seed))

    return make
