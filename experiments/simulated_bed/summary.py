"""How the three models do on a bed, in the figures that the paper reports."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import torch

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.fit_and_score import run
from freelearn.common.errors import UserError
from freelearn.data.beds import NMM
from freelearn.data.sets import TEST, samples_of
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model
from freelearn.records.run import Run

SETS = (*(f"sample{n}" for n in range(1, 9)), "even", "all")
FIT = settings(TrainSettings).fit
# The cheapest first: a bed that is too far by these is not fitted by the others.
MODELS = ("linear", "continuum", "mlp")
# What the paper reports on its own eight samples, whose data are not public: errors E [%], test set for test set over
# ten training sets, and fitted constants [Pa].
TARGETS = {
    "linear mean": 34.9,
    "linear range": 88.8,
    "linear own set": 21.4,
    "linear least": 2.19,
    "continuum mean": 18.1,
    "continuum range": 32.6,
    "continuum own set": 16.87,
    "continuum least": 6.25,
    "continuum most": 38.8,
    "constituents least": 6.63,
    "constituents most": 29.7,
    "mlp mean": 29.6,
    "mlp range": 189.7,
    "mlp own set": 5.51,
    "mlp even on sample1": 192.0,
    "mlp even on sample3": 89.8,
    "mlp even on sample5": 145.0,
    "C1 least": 0.94e5,
    "C1 most": 3.39e5,
    "C2 least": 0.996e6,
    "C2 most": 1.10e6,
}
# With C1 and C2 in Pa an unscaled optimizer hardly moves C2 from its start, 1e6: these say little of the samples.
OF_THE_OPTIMIZER = ("C2 least", "C2 most")
# Factor that a simulated bed may be away from each.
WITHIN = 1.5

Figures = dict[str, float]


def thinned(table: pd.DataFrame, every: int, seed: int) -> pd.DataFrame:
    """Every so manyth kinematic state, drawn at random."""
    if every == 1:
        return table
    state = table.groupby(["sample", "elongation_mm", "twist_deg"], sort=False).ngroup().to_numpy()
    kept = np.random.default_rng(seed).permutation(state.max() + 1) % every == 0
    return table[kept[state]].reset_index(drop=True)


def judged(table: pd.DataFrame, whole: bool, most: float = math.inf) -> tuple[Figures, float]:
    """The paper's figures of a bed, and how far they are from the published ones.

    whole: whether errors are in units of the largest loads of all samples, not of the test set's own (the paper leaves
    it open). None and infinity where the distance is above `most`, where a model cannot be fitted or has nothing to be
    tested on.
    """
    told: Figures = {}
    try:
        told |= _known(table, whole)
        for name in MODELS:
            told |= _fitted(table, name, whole)
            if distance(told) > most:
                return {}, math.inf
    except (UserError, KeyError):
        return {}, math.inf
    return told, distance(told)


def distance(told: Figures) -> float:
    """Root mean square over all targets of the logarithms of the ratios to them; a figure not there yet counts as met,
    so that it only grows. Infinite where a figure is none."""
    every = [name for name in TARGETS if name not in OF_THE_OPTIMIZER]
    ratios = [told.get(name, TARGETS[name]) / TARGETS[name] for name in every]
    if not all(math.isfinite(ratio) and ratio > 0 for ratio in ratios):
        return math.inf
    return float(np.sqrt(np.mean(np.log(ratios) ** 2)))


def _fitted(table: pd.DataFrame, name: str, whole: bool) -> Figures:
    runs = {train: run(build_model(name), table, train, "every", FIT, 0) for train in SETS}
    error = pd.DataFrame({train: _errors(outcome, whole) for train, outcome in runs.items()}).loc[
        list(SETS), list(SETS)
    ]
    every = error.to_numpy()
    told = {f"{name} mean": every.mean(), f"{name} range": np.ptp(every), f"{name} own set": np.diag(every).mean()}
    if name == "mlp":
        return told | {f"mlp even on sample{n}": error.loc[f"sample{n}", "even"] for n in (1, 3, 5)}
    told[f"{name} least"] = every.min()
    if name == "continuum":
        told["continuum most"] = every.max()
        constants = pd.DataFrame([{n: float(v.detach()) for n, v in r.model.values().items()} for r in runs.values()])
        for constant, values in constants.items():
            told |= {f"{constant} least": values.min(), f"{constant} most": values.max()}
    return told


def _known(table: pd.DataFrame, whole: bool) -> Figures:
    """With the constituents' own constants."""
    errors = _errors(run(build_model("continuum"), table, "constituent", "every", None, 0), whole).values()
    return {"constituents least": min(errors), "constituents most": max(errors)}


def _errors(outcome: Run, whole: bool) -> dict[str, float]:
    """E [%] on each test set. whole: in units of the largest loads of the whole table, not of the set's own."""
    if not whole:
        return {test: 100 * outcome.errors[test].E for test in SETS}
    counted = outcome.table["buckled"].to_numpy() == 0
    loads = torch.as_tensor(outcome.table[["force_n", "moment_nmm"]].to_numpy() * [1, NMM])
    missed = ((outcome.prediction.loads - loads) / loads[counted].abs().amax(0)).square().sum(1).numpy()
    usable = (outcome.prediction.status == Status.OK).numpy() & counted & (outcome.labels == TEST)
    sample = outcome.table["sample"].to_numpy()
    return {
        test: 100 * float(missed[usable & np.isin(sample, samples_of(test, sample))].mean() ** 0.5) for test in SETS
    }
