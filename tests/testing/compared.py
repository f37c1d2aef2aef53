"""Tables of the reference bed, what the package shows for them, and how near the two have to be."""

import numpy as np
import pandas as pd
import torch

from freelearn.data.rows import Rows
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import other_beds

C1, C2 = 8e5, 3e7
DESIGNS = {
    "helix": {1: (36.0, np.nan, 98.42, 4.77, 6.74), 2: (-62.0, np.nan, 99.0, 4.77, 6.36)},
    "braid": {1: (24.0, -24.0, 150.0, 5.0, 6.2), 2: (40.0, -40.0, 120.0, 4.77, 6.6)},
    "both": {1: (24.0, -24.0, 150.0, 5.0, 6.2), 2: (36.0, np.nan, 98.42, 4.77, 6.74)},
}
PRESSURES = np.r_[np.linspace(0, 80, 5), 40.0, 3.0, 0.0]
SILENT = dict.fromkeys(other_beds.ACCURACY, 0.0)
SHARE = 1e-6


def table_of(make: str = "helix", kind: str = "kinematic") -> pd.DataFrame:
    places = np.random.default_rng(4).uniform([-6, -80], [4, 80], (6, 2))
    if kind == "dead_load":
        places = places * [1.0, 0.3]
    return other_beds.nominal(kind, DESIGNS[make], np.r_[places, [[0.0, 0.0]]], PRESSURES)


def told(table: pd.DataFrame, fx) -> torch.Tensor:
    """What the package shows, (N, 2) SI."""
    values = {f"{name}.{p}": v for name, ps in fx.items() for p, v in ps.items()}
    model = build_model("continuum", {"C1": C1, "C2": C2} | values, list(fx))
    with torch.no_grad():
        shown, status = model(Rows.from_table(table).states)
    assert (status == 0).all()
    return shown


def assert_near(found, expected, share: float = SHARE) -> None:
    """Every column within this share of the range of its expected values."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert np.isfinite(expected).all()
    assert (np.abs(found - expected).max(0) <= share * np.ptp(expected, axis=0)).all()
