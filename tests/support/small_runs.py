"""A small measured table, and runs on it without a process of their own."""

from pathlib import Path

import numpy as np
import torch

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.train_task import train
from freelearn.data.beds import NMM
from freelearn.data.states import States
from freelearn.physics.models.continuum import Continuum
from freelearn.records.run import Run
from freelearn.testing.small_tables import random_table


def make_csv(path: Path, rows: int = 240, noise: float = 0.02, **columns) -> Path:
    """A small valid table: two samples, ten pressures at each state, loads of a continuum model plus noise."""
    table = random_table(rows // 10, 4).sort_values("sample")
    table = table[table["sample"].isin([3, 6])].reset_index(drop=True)
    table = table.loc[np.repeat(table.index, 10)].reset_index(drop=True)
    table["step"] = np.arange(len(table)) % 10
    table["pressure_kpa"] = np.array([0, 10, 20, 30, 40, 50, 60, 70, 35, 1.0])[table["step"]]
    with torch.no_grad():
        loads = Continuum(1e6, 2e7)(States.from_table(table)).loads.numpy()
    generator = np.random.default_rng(0)
    loads = loads * (1 + noise * generator.normal(size=loads.shape))
    table["force_n"], table["moment_nmm"] = loads[:, 0], loads[:, 1] / NMM
    table.assign(**columns).to_csv(path, index=False)
    return path


def run(folder: Path, *overrides: str) -> Run:
    """What `python train.py figures=false overrides` does, in this process: pictures take nine tenths of a run."""
    return train(settings(TrainSettings, ["fits=null", "figures=false", *overrides]), folder)
