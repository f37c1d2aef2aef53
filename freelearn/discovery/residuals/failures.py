"""Where a model fails, and how much of that the measuring alone would leave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.common.formats import in_words
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import ELONGATION, FORCE, KINEMATIC, MOMENT, PRESSURE, TWIST, Bed, Quantity, bed_of
from freelearn.data.columns import members_in, pressure_column
from freelearn.data.error import load_scale
from freelearn.data.rows import Readings
from freelearn.data.states import States, pressure_direction
from freelearn.discovery.noise.noise import noise_floor, variances
from freelearn.discovery.residuals.regions import Region, regions
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import usable

# Where a model fails: regions of the inputs, told by a shallow tree and put in words.

DEPTH = 3
# Smallest region, as a share of the rows.
SMALLEST = 0.03
# A further split has to explain this share of the residuals' variance; less would only cut regions at random.
SMALLEST_GAIN = 0.02
MOST = 6
EVERYWHERE = "everywhere"
QUANTITIES = (ELONGATION, TWIST, PRESSURE, FORCE, MOMENT)


@dataclass(frozen=True)
class Failure:
    """Rows of one region. mean: predicted − measured of each of the bed's quantities that is measured there, in its
    column's unit; sigma: the same in units of a row's noise."""

    where: str
    rows: int
    share_of_rows: float
    share_of_squared_error: float
    quantities: tuple[Quantity, ...]
    mean: tuple[float, ...]
    sigma: tuple[float, ...]

    def numbers(self) -> dict[str, Any]:
        """The sentence and its numbers, as discovery.json and results.json hold them: mean_force_n, mean_moment_nmm and
        their σ, None where the bed does not measure them, and the same of what else it measures."""
        plain: dict[str, Any] = {"sentence": self.sentence()}
        plain |= {n: getattr(self, n) for n in ("where", "rows", "share_of_rows", "share_of_squared_error")}
        plain |= {f"mean_{q.column}": None for q in (FORCE, MOMENT)} | {
            f"sigma_{q.name}": None for q in (FORCE, MOMENT)
        }
        for quantity, mean, sigma in zip(self.quantities, self.mean, self.sigma, strict=True):
            plain |= {f"mean_{quantity.column}": mean, f"sigma_{quantity.name.replace(' ', '_')}": sigma}
        return plain

    def sentence(self) -> str:
        """What a researcher would say about it."""
        parts = [
            # Loads have signs: one of −100 N in the place of −114 N is too high, and not "over-predicted".
            f"predicted {q.name} is {in_words(abs(mean))}{q.suffix} too {'high' if mean > 0 else 'low'} "
            f"({abs(sigma):.1f} σ)"
            for q, mean, sigma in zip(self.quantities, self.mean, self.sigma, strict=True)
            if abs(sigma) >= 0.5
        ]
        scattered = "loads" if {FORCE, MOMENT} == set(self.quantities) else "readings"
        what = " and ".join(parts) or f"{scattered} scatter without a common sign"
        place = self.where if self.where == EVERYWHERE else f"where {self.where}"
        return (
            f"{what} {place}: {100 * self.share_of_rows:.0f} % of the rows hold "
            f"{100 * self.share_of_squared_error:.0f} % of the squared error"
        )


def inputs_of(table: pd.DataFrame) -> pd.DataFrame:
    """What a region may depend on, in engineering units: sample, what the bed imposes (elongation, twist, pressure),
    and direction."""
    state = {quantity.name: table[quantity.column].to_numpy() for quantity in bed_of(table).state}
    members = members_in(table.columns)
    pressures = {f"pressure {m}": table[pressure_column(m)].to_numpy() for m in members}
    return pd.DataFrame(
        {
            "sample": table["sample"].to_numpy(),
            **state,
            **(pressures or {"pressure": table["pressure_kpa"].to_numpy()}),
            "direction": pressure_direction(table),
        },
        copy=False,
    )


def failures(
    inputs: pd.DataFrame, residual: np.ndarray, scale: np.ndarray, noise: np.ndarray, bed: Bed = KINEMATIC
) -> list[Failure]:
    """Regions by their share of the squared error, worst first.

    inputs: see `inputs_of`, N rows. residual: predicted − measured (N, 2) N, N·m, or what else the bed measures, NaN
    where nothing was. scale: (2,), largest loads, which the error is normalized by. noise: (N, 2), one standard
    deviation of each load. The tree splits on the signed residuals, so a region is one where the model errs in one way.
    """
    if inputs.empty:
        return []  # every reading is suspected
    told = [i for i, quantity in enumerate(bed.readings) if quantity in bed.measured]
    quantities = tuple(bed.readings[i] for i in told)
    there = np.isfinite(residual)
    scaled = np.where(there, residual, 0.0) / scale
    leaf = max(10, int(SMALLEST * len(inputs)))
    least = SMALLEST_GAIN * float(scaled.var(0).mean())
    columns = {str(name): inputs[name].to_numpy(dtype=np.float64) for name in inputs.columns}
    found = regions(columns, scaled, DEPTH, leaf, least)
    del columns
    squared = (scaled**2).sum(1)
    regional = []
    for region in found:
        inside = region.inside
        count = there[inside].sum(0)
        with np.errstate(invalid="ignore"):  # a quantity that was read in no row of the region
            mean = np.nansum(residual[inside], 0) / count
            sigma = mean / np.sqrt((noise[inside] ** 2 * there[inside]).sum(0) / count).clip(1e-300)
        regional.append(
            Failure(
                _where(inputs, region),
                int(inside.sum()),
                float(inside.mean()),
                float(squared[inside].sum() / squared.sum()) if squared.sum() else 0.0,
                quantities,
                tuple(float(mean[i] / bed.readings[i].factor) for i in told),
                tuple(float(sigma[i]) for i in told),
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
            words.append(f"{low[name]:.3g} < {name} ≤ {high[name]:.3g}{_unit_of(name)}")
        elif name in low:
            words.append(f"{name} > {low[name]:.3g}{_unit_of(name)}")
        else:
            words.append(f"{name} ≤ {high[name]:.3g}{_unit_of(name)}")
    return " and ".join(words).replace("-", "−") or EVERYWHERE


def _unit_of(name: str) -> str:
    """The unit of an input, by its name in `inputs_of`."""
    return next(q.suffix for q in QUANTITIES if q.name == name.split(" ")[0])


def split_errors(inputs: pd.DataFrame, residual: np.ndarray, scale: np.ndarray, bed: Bed = KINEMATIC) -> pd.DataFrame:
    """Error E and its parts (of a bed that measures loads force and moment) by sample, thirds of what is imposed, and
    direction; a part is NaN where nothing was measured. Arguments as of `failures`."""
    scaled = residual / scale
    groups: dict[str, pd.Series] = {"sample": inputs["sample"].astype(str)}
    for name in [str(column) for column in inputs.columns if column not in ("sample", "direction")]:
        unit = _unit_of(name)
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
            with np.errstate(invalid="ignore"):
                squares = np.nansum(part**2, 0) / np.isfinite(part).sum(0)
            rows.append((by, value, len(part), float(np.nansum(squares) ** 0.5), *np.sqrt(squares).tolist()))
    parts = [f"E_{quantity.name.replace(' ', '_')}" for quantity in bed.readings]
    return pd.DataFrame(rows, columns=["by", "value", "rows", "E", *parts])


# What a fitted model's residuals say beside what the measuring alone would leave.

# Fewer rows are no region.
FEWEST = 40


@dataclass(frozen=True)
class Misfit:
    """failures: regions by their share of the squared error, worst first. noise_floor: the E that a perfect model
    would have on the training set's own test rows (all rows where none were fitted), a fraction."""

    failures: list[Failure]
    noise_floor: float


def misfit(model: Model, predictions: pd.DataFrame, accuracy: Accuracy) -> Misfit | None:
    """Where the model fails, and how small its error could be; None with too few rows.

    predictions: whole samples, in the columns of predictions.csv.
    """
    predictions = predictions.reset_index(drop=True)
    rows = usable(predictions).index.to_numpy(copy=True)
    if len(rows) < FEWEST:
        return None
    # Of many rows copies count: none where all are used, and nothing is held longer than it is needed.
    every = len(rows) == len(predictions)
    kept = predictions if every else predictions.iloc[rows]
    states, readings = States.from_table(predictions), Readings.from_table(kept)
    bed = states.bed
    variance = variances(model, states if every else states[torch.as_tensor(rows)], accuracy, readings.present)
    del states, rows
    tested = torch.as_tensor((kept["split"] == "test").to_numpy(copy=True))
    scored = tested if bool(tested.any()) else ~tested
    floor = noise_floor(variance[scored], readings.present[scored], load_scale(readings.value[scored]))
    missed = readings.missed(Readings.from_table(kept, predicted=True).value)
    residual = torch.where(readings.present, missed, torch.nan).numpy()
    scale = load_scale(readings.value).numpy()
    del readings, missed
    inputs = inputs_of(predictions)
    inputs = inputs if every else inputs.loc[kept.index].reset_index(drop=True)
    return Misfit(failures(inputs, residual, scale, variance.sqrt_().numpy(), bed), floor)
