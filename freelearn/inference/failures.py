"""Where a model fails: regions of the inputs, told by a shallow tree and put in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from freelearn.inference.regions import Region, regions
from freelearn.measurements.states import pressure_direction
from freelearn.units import NMM

DEPTH = 3
# Smallest region, as a share of the rows.
SMALLEST = 0.03
# A further split has to explain this share of the residuals' variance; less would only cut regions at random.
SMALLEST_GAIN = 0.02
MOST = 6
EVERYWHERE = "everywhere"
UNITS = {"elongation": " mm", "twist": "°", "pressure": " kPa"}


@dataclass(frozen=True)
class Failure:
    """Rows of one region. mean_force_n, mean_moment_nmm: predicted − measured; sigma_*: in units of a row's noise."""

    where: str
    rows: int
    share_of_rows: float
    share_of_squared_error: float
    mean_force_n: float
    mean_moment_nmm: float
    sigma_force: float
    sigma_moment: float

    def numbers(self) -> dict[str, Any]:
        """The sentence and its numbers, as discovery.json and results.json hold them."""
        return {"sentence": self.sentence(), **vars(self)}

    def sentence(self) -> str:
        """What a researcher would say about it."""
        parts = [
            f"{load} is {'over' if mean > 0 else 'under'}-predicted by {abs(mean):.3g} {unit} ({abs(sigma):.1f} σ)"
            for load, mean, sigma, unit in (
                ("force", self.mean_force_n, self.sigma_force, "N"),
                ("moment", self.mean_moment_nmm, self.sigma_moment, "N·mm"),
            )
            if abs(sigma) >= 0.5
        ]
        what = " and ".join(parts) or "loads scatter without a common sign"
        place = self.where if self.where == EVERYWHERE else f"where {self.where}"
        return (
            f"{what} {place}: {100 * self.share_of_rows:.0f} % of the rows hold "
            f"{100 * self.share_of_squared_error:.0f} % of the squared error"
        )


def inputs_of(table: pd.DataFrame) -> pd.DataFrame:
    """What a region may depend on, in engineering units: sample, elongation, twist, pressure, direction."""
    return pd.DataFrame(
        {
            "sample": table["sample"].to_numpy(),
            "elongation": table["elongation_mm"].to_numpy(),
            "twist": table["twist_deg"].to_numpy(),
            "pressure": table["pressure_kpa"].to_numpy(),
            "direction": pressure_direction(table),
        }
    )


def failures(inputs: pd.DataFrame, residual: np.ndarray, scale: np.ndarray, noise: np.ndarray) -> list[Failure]:
    """Regions by their share of the squared error, worst first.

    inputs: see `inputs_of`, N rows. residual: predicted − measured (N, 2) N, N·m. scale: (2,), largest loads, which the
    error is normalized by. noise: (N, 2), one standard deviation of each load. The tree splits on the signed residuals,
    so a region is one where the model errs in one way.
    """
    scaled = residual / scale
    leaf = max(10, int(SMALLEST * len(inputs)))
    least = SMALLEST_GAIN * float(scaled.var(0).mean())
    columns = {str(name): inputs[name].to_numpy(dtype=np.float64) for name in inputs.columns}
    squared = (scaled**2).sum(1)
    regional = []
    for region in regions(columns, scaled, DEPTH, leaf, least):
        inside = region.inside
        mean = residual[inside].mean(0)
        sigma = mean / np.sqrt((noise[inside] ** 2).mean(0))
        regional.append(
            Failure(
                _where(inputs, region),
                int(inside.sum()),
                float(inside.mean()),
                float(squared[inside].sum() / squared.sum()) if squared.sum() else 0.0,
                float(mean[0]),
                float(mean[1] / NMM),
                float(sigma[0]),
                float(sigma[1]),
            )
        )
    return sorted(regional, key=lambda f: -f.share_of_squared_error)[:MOST]


def _where(inputs: pd.DataFrame, region: Region) -> str:
    """The region's conditions in words; only inputs that bound it."""
    low, high, inside = region.low, region.high, region.inside
    words = []
    for name in inputs.columns:
        if name not in low and name not in high:
            continue
        if name == "sample":
            chosen = [str(n) for n in np.unique(inputs["sample"][inside])]
            words.append(f"sample {', '.join(chosen)}" if len(chosen) == 1 else f"samples {', '.join(chosen)}")
        elif name == "direction":
            kinds = {-1.0: "falling", 0.0: "at its first step", 1.0: "rising"}
            words.append("pressure is " + " or ".join(kinds[d] for d in np.unique(inputs["direction"][inside])))
        elif name in low and name in high:
            words.append(f"{low[name]:.3g} < {name} ≤ {high[name]:.3g}{UNITS[name]}")
        elif name in low:
            words.append(f"{name} > {low[name]:.3g}{UNITS[name]}")
        else:
            words.append(f"{name} ≤ {high[name]:.3g}{UNITS[name]}")
    return " and ".join(words).replace("-", "−") or EVERYWHERE


def split_errors(inputs: pd.DataFrame, residual: np.ndarray, scale: np.ndarray) -> pd.DataFrame:
    """Error E and its force and moment parts by sample, thirds of elongation, twist and pressure, and direction."""
    scaled = residual / scale
    groups: dict[str, pd.Series] = {"sample": inputs["sample"].astype(str)}
    for name, unit in UNITS.items():
        if inputs[name].nunique() > 2:
            thirds = pd.qcut(inputs[name], 3, duplicates="drop")
            groups[name] = thirds.map(lambda i, u=unit: f"{i.left:.3g} … {i.right:.3g}{u}").astype(str)
        else:
            groups[name] = inputs[name].map(lambda v, u=unit: f"{v:.3g}{u}")
    groups["direction"] = inputs["direction"].map({-1.0: "falling", 0.0: "first step", 1.0: "rising"})
    rows = []
    for by, group in groups.items():
        for value in group.unique():
            part = scaled[(group == value).to_numpy()]
            force, moment = np.sqrt((part**2).mean(0))
            rows.append((by, value, len(part), float(np.hypot(force, moment)), float(force), float(moment)))
    return pd.DataFrame(rows, columns=["by", "value", "rows", "E", "E_force", "E_moment"])
