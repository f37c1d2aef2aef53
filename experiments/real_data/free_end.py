"""The pose of a free end block from three pressures: a corner left out, random tenths, and how well poses repeat."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from free_block import BUILT, BUILT_EACH, LEANING, MEMBERS, OF_EACH, RUBBERS, START
from left_out import fit
from questions import PRESSURES
from rich.table import Table
from sets import RealSet
from smooth_rivals import Predict, gaussian_process, least_squares, levels, more_inputs, polynomial_columns

from freelearn.data.rows import Rows
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS

# Elongation in mm and rotation in degrees.
SHOWN = np.array([1e3, 180 / np.pi])
TENTHS, SEED = 10, 0
# Effects, and those of which each actuator has a value of its own.
PHYSICAL = (
    ((), ()),
    (("off_axis",), ()),
    (("off_axis", "small_strain_stiffness"), ()),
    (LEANING, OF_EACH),
    ((*LEANING, "wall_thickness"), OF_EACH),
    ((*LEANING, "block_tilt"), OF_EACH),
    ((*LEANING, "block_tilt", "end_taper"), OF_EACH),
    ((*LEANING, "wall_thickness"), ("wall_thickness",)),
    (RUBBERS, BUILT_EACH),
    ((*RUBBERS, "end_taper"), BUILT_EACH),
    (BUILT, BUILT_EACH),
)


def free_end_table(chosen: RealSet, out: Path) -> Table:
    """RMSE of elongation and rotation, in and out of the fit: smooth rivals, the models of PHYSICAL, and repeats."""
    table = chosen.read(out)
    rows, pressures = Rows.from_table(table), table[list(PRESSURES)].to_numpy(float)
    raw = pd.read_csv(chosen.table(out))
    pose, corner, tenth = rows.readings.value.numpy(), _corner(pressures), _tenths(len(table))
    heads = ("parameters", "all rows", "corner left out", "random tenths left out", "values")
    shown = Table("model", *heads, title="parallel_free_end: root mean square error, mm / degrees")
    everywhere = np.ones(len(table), dtype=bool)

    def row(name: str, count: int, predict: Predict, values: Callable[[], str] = str) -> None:
        missed = [predict(everywhere, everywhere) - pose]
        told = values()
        missed.append(predict(~corner, corner) - pose[corner])
        folds = [predict(tenth != k, tenth == k) - pose[tenth == k] for k in range(TENTHS)]
        shown.add_row(name, str(count), *(_told(e) for e in [*missed, np.concatenate(folds)]), told)

    for degree, name in ((1, "straight line"), (2, "square"), (3, "cubic"), (4, "quartic"), (5, "quintic")):
        columns = polynomial_columns(pressures, degree)
        row(f"{name} in the pressures", 2 * columns.shape[1], least_squares(columns, pose))
    for name, columns in more_inputs(raw, pressures).items():
        row(f"cubic and {name}", 2 * columns.shape[1], least_squares(columns, pose))
    # It has no parameters to count: what it was fitted to is its memory.
    row("Gaussian process in the pressures", 0, gaussian_process(pressures, pose))
    for effects, of_each in PHYSICAL:
        physical = _Physical(rows, effects, of_each)
        row(" + ".join(["continuum", *effects]), len(physical.start), physical, physical.values)
    for name, spread in repeats(raw, pose).items():
        shown.add_row(f"repeats: {name}", "", _told(spread), "", "", "")
    return shown


def repeats(raw: pd.DataFrame, pose: np.ndarray) -> dict[str, np.ndarray]:
    """What no smooth function of the pressures can tell: differences (n, 2) of poses at neighboring commands.

    No command was given twice. Of four poses at the corners of a rectangle of neighboring commands, two pressures one
    step apart, f(1,1) − f(2,1) − f(1,2) + f(2,2) knows no slope, and has twice the scatter of one of them. Half
    of it is given.
    """
    level = levels(raw)
    place = {tuple(at): i for i, at in enumerate(level.tolist())}
    unit = np.eye(3, dtype=int)
    found = {}
    for a, b in ((0, 1), (0, 2), (1, 2)):
        steps = (0 * unit[a], unit[a], unit[b], unit[a] + unit[b])
        fours = [[place.get(tuple((at + step).tolist())) for step in steps] for at in level]
        four = np.array([each for each in fours if None not in each], dtype=int)
        found[f"pressures {a + 1} and {b + 1} a step apart"] = (pose[four] * [[[1], [-1], [-1], [1]]]).sum(1) / 2
    return found


def _corner(pressures: np.ndarray) -> np.ndarray:
    """The block left out, chosen before any model was looked at: all three high, or the third without the first."""
    high = (pressures > np.percentile(pressures, 60, axis=0)).all(1)
    third, first = pressures[:, 2], pressures[:, 0]
    crossed: np.ndarray = high | ((third > np.percentile(third, 75)) & (first < np.percentile(first, 25)))
    return crossed


def _tenths(count: int) -> np.ndarray:
    """The tenth of each row, (N,) int."""
    return np.random.default_rng(SEED).permutation(np.arange(count) % TENTHS)


class _Physical:
    """The continuum model with effects; every later fit starts from the first one. of_each: as in PHYSICAL."""

    def __init__(self, rows: Rows, effects: tuple[str, ...], of_each: tuple[str, ...]) -> None:
        # In the order of the registry, as they act.
        made = [EFFECTS[name](members=MEMBERS if name in of_each else 0) for name in EFFECTS if name in effects]
        self.model, self.rows = MODELS["continuum"](effects=made), rows
        self.model.set_values({name: value for name, value in START.items() if name in self.model.declared})
        self.start = self.model.vector().detach().clone()

    def __call__(self, fitted: np.ndarray, asked: np.ndarray) -> np.ndarray:
        vector = fit(self.model, self.rows[torch.as_tensor(fitted.copy())], self.start)
        if fitted.all():
            self.start = vector
        with torch.no_grad():
            predicted: np.ndarray = self.model(self.rows[torch.as_tensor(asked.copy())].states).loads.numpy()
        return predicted

    def values(self) -> str:
        """The parameters of the last fit, SI."""
        return ", ".join(f"{name.split('.')[-1]} {value:.3g}" for name, value in self.model.scalars().items())


def _told(missed: np.ndarray) -> str:
    z, rotation = np.sqrt(np.square(missed * SHOWN).mean(0))
    return f"{z:.3f} / {rotation:.2f}"
