"""What simulated actuators may be made of: a prior over materials, imperfections and how samples differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import ndtr

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.data.beds import NMM
from freelearn.physics.simulated_bed import DESIGNS, simulate

SAMPLES = len(DESIGNS)
DATA = settings(TrainSettings).data
ACCURACY, BUCKLED = vars(DATA.accuracy), DATA.buckled_share


@dataclass(frozen=True)
class Size:
    """One number about all samples, between two values; evenly in its logarithm where both are positive."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """The number below which this share of the prior lies."""
        if self.low > 0:
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + (self.high - self.low) * share)


# Numbers about all samples, SI. A spread is one standard deviation of what differs from sample to sample.
SIZES = {
    "C1": Size(0.5e5, 1e6),
    "C2": Size(2e5, 4e7),
    "spread of log C1": Size(0.01, 0.7),
    "spread of log C2": Size(0.01, 0.7),
    "slack share": Size(0.0, 1.0),
    "clamp length": Size(0.0, 8e-3),
    "spread of twist offset": Size(3e-3, 0.5),
    "spread of length offset": Size(5e-5, 3e-3),
    "spread of fiber angle": Size(1e-3, 0.08),
    "spread of force gain": Size(0.005, 0.5),
    "spread of moment gain": Size(0.005, 0.5),
    "spread of force offset": Size(0.01, 5.0),
    "spread of moment offset": Size(1e-4, 0.05),
    "friction, share of the loads": Size(2e-3, 0.2),
    "crosstalk": Size(0.0, 1.0),
    "bladder stiffness": Size(10.0, 3000.0),
    "errors of measuring, times the stated": Size(1.0, 8.0),
}
# What differs from sample to sample, in units of its spread.
OWN = ("log C1", "log C2", "twist offset", "length offset", "fiber angle", "force gain", "moment gain", "force offset",
       "moment offset")  # fmt: skip
COUNT = len(SIZES) + len(OWN) * SAMPLES


def sizes(numbers: np.ndarray) -> dict[str, float]:
    """The numbers about all samples, from standard normal ones."""
    return {name: size.at(float(ndtr(u))) for (name, size), u in zip(SIZES.items(), numbers, strict=False)}


def made(numbers: np.ndarray, seed: int) -> pd.DataFrame:
    """The bed's table. numbers: (COUNT,), standard normal in the prior."""
    size = sizes(numbers)
    own = dict(zip(OWN, numbers[len(SIZES) :].reshape(len(OWN), SAMPLES), strict=True))

    def differing(name: str, most: float = np.inf) -> list[float]:
        return np.clip(size[f"spread of {name}"] * own[name], -most, most).tolist()

    truth = {name: (size[name] * np.exp(differing(f"log {name}"))).tolist() for name in ("C1", "C2")}
    effects: dict[str, Any] = {
        "fiber_tension_only": {"share": size["slack share"]},
        "end_clamps": {"clamp_length": size["clamp length"]},
        "twist_offset": {"angle": differing("twist offset", 1.0)},
        "length_offset": {"length": differing("length offset", 5e-3)},
        "fiber_misalignment": {"angle": differing("fiber angle", 0.2)},
        "bladder_stiffness": {"stiffness": size["bladder stiffness"]},
        "force_gain": {"gain": differing("force gain", 0.9)},
        "moment_gain": {"gain": differing("moment gain", 0.9)},
        "force_offset": {"force": differing("force offset")},
        "moment_offset": {"moment": differing("moment offset")},
        "sensor_crosstalk": {
            "moment_into_force": 3.43 * size["crosstalk"],
            "force_into_moment": 6e-4 * size["crosstalk"],
        },
    }
    accuracy = {name: value * size["errors of measuring, times the stated"] for name, value in ACCURACY.items()}
    smooth = simulate(truth, effects, accuracy, BUCKLED, seed)
    # Friction is a share of what the sample's loads are.
    spread = smooth[smooth["buckled"] == 0].groupby("sample")[["force_n", "moment_nmm"]].std()
    spread = spread.reindex(range(1, SAMPLES + 1)).fillna(0.0) * size["friction, share of the loads"]
    effects["friction_hysteresis"] = {
        "force": spread["force_n"].tolist(),
        "moment": (spread["moment_nmm"] * NMM).tolist(),
    }
    return simulate(truth, effects, accuracy, BUCKLED, seed)
