"""The pose of a free end block from three pressures: a corner left out, random tenths, and how well poses repeat."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from free_block import LEANING, MEMBERS, OF_EACH, START
from left_out import fit
from questions import PRESSURES
from rich.table import Table
from sets import RealSet

from freelearn.data.rows import Rows
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS

COMMANDED = ("P1_cmd_Pa", "P2_cmd_Pa", "P3_cmd_Pa")
# Elongation in mm and rotation in degrees.
SHOWN = np.array([1e3, 180 / np.pi])
TENTHS, SEED = 10, 0
PHYSICAL = (
    (),
    ("off_axis",),
    ("off_axis", "small_strain_stiffness"),
    LEANING,
    (*LEANING, "wall_thickness"),
    (*LEANING, "block_tilt"),
    (*LEANING, "block_tilt", "end_taper"),
)

# Rows to fit and rows to predict, (N,) bool each → (n, 2) m and rad.
Predict = Callable[[np.ndarray, np.ndarray], np.ndarray]


def free_end_table(chosen: RealSet, out: Path) -> Table:
    """RMSE of elongation and rotation, in and out of the fit: polynomials, the models of PHYSICAL, and repeats."""
    table = chosen.read(out)
    rows, pressures = Rows.from_table(table), table[list(PRESSURES)].to_numpy(float)
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

    for degree, name in ((1, "straight line"), (3, "cubic")):
        polynomial = _Polynomial(pressures, pose, degree)
        row(f"{name} in the pressures", 2 * polynomial.columns.shape[1], polynomial)
    for effects in PHYSICAL:
        physical = _Physical(rows, effects)
        row(" + ".join(["continuum", *effects]), len(physical.start), physical, physical.values)
    for name, spread in repeats(pd.read_csv(chosen.table(out)), pose).items():
        shown.add_row(f"repeats: {name}", "", _told(spread), "", "", "")
    return shown


def repeats(raw: pd.DataFrame, pose: np.ndarray) -> dict[str, np.ndarray]:
    """What no smooth function of the pressures can tell: differences (n, 2) of poses at neighboring commands.

    No command was given twice. Of four poses at the corners of a rectangle of neighboring commands, two pressures one
    step apart, f(1,1) − f(2,1) − f(1,2) + f(2,2) knows no slope, and has twice the scatter of one of them. Half
    of it is given.
    """
    level = np.stack([np.unique(raw[name].round(), return_inverse=True)[1] for name in COMMANDED], axis=1)
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


@dataclass(frozen=True)
class _Polynomial:
    """A full polynomial in the three pressures."""

    pressures: np.ndarray
    pose: np.ndarray
    degree: int

    @property
    def columns(self) -> np.ndarray:
        x = (self.pressures - self.pressures.mean(0)) / self.pressures.std(0)
        powers = [p for p in np.ndindex(*[self.degree + 1] * 3) if sum(p) <= self.degree]
        return np.stack([np.prod(x ** np.array(p), axis=1) for p in powers], axis=1)

    def __call__(self, fitted: np.ndarray, asked: np.ndarray) -> np.ndarray:
        columns = self.columns
        predicted: np.ndarray = columns[asked] @ np.linalg.lstsq(columns[fitted], self.pose[fitted], rcond=None)[0]
        return predicted


class _Physical:
    """The continuum model with effects; every later fit starts from the first one."""

    def __init__(self, rows: Rows, effects: tuple[str, ...]) -> None:
        # In the order of the registry, as they act.
        made = [EFFECTS[name](members=MEMBERS if name in OF_EACH else 0) for name in EFFECTS if name in effects]
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
