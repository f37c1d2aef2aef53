"""Loads that begin at zero wherever the bed stands: the cell was zeroed anew at each place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import torch
from scipy.optimize import nnls
from scipy.special import fdtrc

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import FORCE, KINEMATIC, MOMENT, Quantity, bed_of
from freelearn.data.rows import Rows
from freelearn.data.states import kinematic_state
from freelearn.discovery.checks.plain_fit import Plain
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck

NAME = "zero of each place"
# Places that tell, standard deviations or share of the largest load within which a load is zero, and share of the
# places where it is.
FEWEST, ZERO, NOTHING, MOST = 6, 3.0, 0.003, 0.9
# Chance at which a plane over the places explains what loads scatter by in the first rows, below which it is one:
# a cell that was zeroed at each of them shows none of it, rubber beside threads that hang loose does.
CHANCE = 1e-3
# How many times less a model errs of what loads change by from each place's first row than of the loads, and standard
# deviations that its loads have in that row.
BETTER, LOADED = 3.0, 10.0
# C1 and C2 [Pa]: loads at once and twice each say what they are at any other, in which they are linear.
MODULI = 1e6, 1e7
# Rows that are looked at, about.
ENOUGH = 600


def zeros_of_places(plain: Plain, accuracy: Accuracy) -> TableCheck:
    """Whether loads are zero in the first row of every place, and only their changes from there are a tube's.

    What was taken off differs from place to place then, and no effect mends it."""
    table = plain.table
    state = kinematic_state(table)
    begins = np.diff(state, prepend=-1) != 0
    if bed_of(table) is not KINEMATIC or not FEWEST <= begins.sum() <= len(table) / 2:
        return TableCheck(NAME, CANNOT, None, BETTER, "Told of several rows at each of some lengths and twists.")
    zeroed = [q for q in (FORCE, MOMENT) if q.column in table and _begins_at_zero(table, q, begins, accuracy)]
    if not zeroed:
        return TableCheck(NAME, PASS, None, BETTER, "Loads begin at other values at other places.")
    some = state < max(ENOUGH * begins.sum() // len(table), FEWEST)
    better, loads = _by_changes(plain, table[some].reset_index(drop=True), zeroed)
    loaded = any(load > LOADED * _sigma(q, accuracy) for q, load in zip(zeroed, loads, strict=True))
    if better < BETTER or not loaded:
        return TableCheck(NAME, PASS, better, BETTER, "Loads that begin at zero are those of such a tube.")
    says = (
        f"The load cell was zeroed at each place: {' and '.join(q.column for q in zeroed)} "
        f"begin{'s' * (len(zeroed) == 1)} at zero at all of {int(begins.sum())}, and of what loads change by from "
        f"there a model errs {better:.2g} times less; give loads with one zero, that of the tube at rest."
    )
    return TableCheck(NAME, FAIL, better, BETTER, says)


def _sigma(quantity: Quantity, accuracy: Accuracy) -> float:
    return float(getattr(accuracy, quantity.error))


def _begins_at_zero(table: pd.DataFrame, quantity: Quantity, begins: np.ndarray, accuracy: Accuracy) -> bool:
    values = np.abs(table[quantity.column].to_numpy(np.float64)) * quantity.factor
    if not np.isfinite(values).all():
        return False
    within = max(ZERO * _sigma(quantity, accuracy), NOTHING * float(values.max()))
    return bool((values[begins] <= within).mean() >= MOST) and not _springs(table[begins], quantity.column)


def _springs(first: pd.DataFrame, column: str) -> bool:
    """Whether what is read in the first rows goes with where they are: by the F-test of a plane."""
    load = first[column].to_numpy(np.float64)
    places = [first[name].to_numpy(np.float64) for name in ("elongation_mm", "twist_deg") if first[name].nunique() > 1]
    samples = pd.get_dummies(first["sample"]).to_numpy(np.float64)
    level = samples @ np.linalg.lstsq(samples, load, rcond=None)[0]
    plane = np.column_stack([samples, *places])
    left = load - plane @ np.linalg.lstsq(plane, load, rcond=None)[0]
    explained, freedom = float(((load - level) ** 2).sum() - (left**2).sum()), len(load) - np.linalg.matrix_rank(plane)
    if freedom < 1 or explained <= 0 or not places:
        return False
    size = max(float((left**2).sum()) / freedom, 1e-300)
    return bool(fdtrc(len(places), freedom, explained / len(places) / size) < CHANCE)


def _by_changes(plain: Plain, table: pd.DataFrame, zeroed: Sequence[Quantity]) -> tuple[float, list[float]]:
    """How many times less the plain model errs of the changes than of the loads, and, of each quantity, the root mean
    square of the loads [SI] that it then has in the rows that are read as zero."""
    rows = Rows.from_table(table)
    first = np.unique(rows.state, return_index=True)[1][rows.state]
    once, *twice = (_loads(plain, rows, times) for times in ((1, 1), (2, 1), (1, 2)))
    # Of each row: what either modulus makes, and what none does, (N, 2).
    by = [loads - once for loads in twice]
    alone = once - by[0] - by[1]
    channels = [rows.states.bed.readings.index(quantity) for quantity in zeroed]
    size = np.abs(rows.loads.numpy()).max(0).clip(min=1e-300)
    design = (np.stack(by, axis=-1) / size[:, None])[:, channels]
    target = ((rows.loads.numpy() - alone) / size)[:, channels]
    there = np.isfinite(design).all((1, 2)) & np.isfinite(target).all(1)
    there &= there[first]
    later = there & (np.arange(len(table)) != first)
    whole, _ = _left(design[there], target[there])
    changes, moduli = _left((design - design[first])[later], (target - target[first])[later])
    begun = np.unique(first[there])
    shown = (alone + by[0] * moduli[0] + by[1] * moduli[1])[begun]
    return whole / max(changes, 1e-12), [float(np.sqrt(np.mean(shown[:, c] ** 2))) for c in channels]


def _loads(plain: Plain, rows: Rows, times: tuple[int, int]) -> np.ndarray:
    """At so many times either modulus, (N, 2) SI, NaN where the model has none."""
    model = plain.model(rows, {name: n * modulus for name, n, modulus in zip(("C1", "C2"), times, MODULI, strict=True)})
    with torch.no_grad():
        shown: np.ndarray = model(rows.states).loads.numpy()
    return shown


def _left(design: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray]:
    """Root mean square of targets (n, c) that moduli, none below zero, leave by designs (n, c, 2), and these."""
    flat = design.reshape(-1, 2)
    size = np.sqrt((flat**2).sum(0)).clip(min=1e-300)
    found, rest = nnls(flat / size, target.reshape(-1))
    return float(rest) / max(target.size, 1) ** 0.5, found / size
