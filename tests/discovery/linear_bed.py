"""A bed with four numbers in it: springs and a piston, written once in NumPy and once as a model. No mechanics."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.discovery.fits.prepare import Question
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.effects.registry import make_effects
from freelearn.testing.reference.laboratory import Laboratory, protocol, slip

# Γ [deg], L, R_i, R_o [mm].
ACTUATORS = {1: (36.0, 98.42, 4.77, 6.74), 2: (62.0, 99.0, 4.77, 6.36)}
# N/m, N·m/rad, N/Pa, N·m/Pa: 10 N and 0.1 N·m from end to end, as of the paper's actuators.
TRUE = np.array([2e3, 0.05, 1e-4, 1e-6])
ACCURACY = Accuracy(length=3e-5, twist=5e-3, pressure=150.0, force=0.03, moment=6e-4)
# Standard deviation of each load, the pressure's share included [N, N·m].
NOISE = np.hypot([ACCURACY.force, ACCURACY.moment], TRUE[2:] * ACCURACY.pressure)
SHORT = {"states": 24, "pressures": 4, "falling": 1}


class Springs(Parameters):
    """Of length and twist, and the piston's area and the moment that goes with it."""

    stiffness: Tensor = parameter("k", "N/m", start=1e3)
    torsion: Tensor = parameter("c", "N·m/rad", start=0.1)
    area: Tensor = parameter("A", "m²", start=0.0)
    turn: Tensor = parameter("B", "m³", start=0.0)


class LinearBed(Model[Springs]):
    name = "linear_bed"
    parameter_class = Springs

    def structure(self, states: States, p: Springs) -> Tensor:
        force = p.area * states.pressure - p.stiffness * (states.length - states.reference_length)
        return torch.stack([force, p.turn * states.pressure - p.torsion * states.twist], dim=-1)


@dataclass(frozen=True)
class Bench:
    """table: a protocol without loads; loads (N, 2) as measured, SI; error (N, 2): of the sensors; state (N,); moved
    (states, 2): position errors, m and rad."""

    table: pd.DataFrame
    loads: np.ndarray
    error: np.ndarray
    state: np.ndarray
    moved: np.ndarray

    @property
    def rows(self) -> Rows:
        return Rows.whole(States.from_table(self.table), torch.as_tensor(self.loads.copy()), self.state)

    def showing(self, readings: Mapping[tuple[int, int], float]) -> "Bench":
        """The same, but for readings that show something else: (row, load) → N or N·m."""
        loads = self.loads.copy()
        for place, reading in readings.items():
            loads[place] = reading
        return replace(self, loads=loads)

    def slipped(self, share: float, kinds, seed: int) -> tuple["Bench", pd.DataFrame]:
        """The same with slips in a share of the rows, and the truth about them, sensor_sigmas as of all row noise."""
        table = self.table.assign(buckled=0, force_n=self.loads[:, 0], moment_nmm=1e3 * self.loads[:, 1])
        force, moment = NOISE
        deviation = {"force_n": np.full(len(table), force), "moment_nmm": np.full(len(table), 1e3 * moment)}
        table, truth = slip(table, share, kinds, deviation, [seed, 5])
        loads = np.stack([table["force_n"], table["moment_nmm"] / 1e3], axis=1)
        return replace(self, loads=loads), truth.assign(column=(truth["load"] == "moment_nmm").astype(int))

    def question(self, candidates=(), accuracy: Accuracy = ACCURACY, seed: int = 0) -> Question:
        def build(names):
            return LinearBed(make_effects(names, LinearBed.family))

        return Question(build, list(candidates), self.rows, accuracy, seed)


def normal(generator: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return generator.normal(size=shape)


def student(freedom: float):
    """Noise of Student's t, of standard deviation one."""
    return lambda generator, shape: generator.standard_t(freedom, shape) * np.sqrt(1 - 2 / freedom)


def bench(seed: int, states: int = 30, samples=(1, 2), noise=normal, extra=None, true=ACCURACY, **laboratory) -> Bench:
    """Measures the protocol of a laboratory. extra: (states, loads (N, 2)) → loads, what the model does not know."""
    actuators = {n: ACTUATORS[n] for n in samples}
    table = protocol(Laboratory(states=states, **laboratory), actuators, np.random.default_rng([seed, 76]))
    return measured(table, seed, noise, extra, true)


def measured(table: pd.DataFrame, seed: int, noise=normal, extra=None, true=ACCURACY) -> Bench:
    """Measures what a table sets out to impose."""
    generator = np.random.default_rng([seed, 77])
    state = kinematic_state(table)
    s = States.from_table(table)
    moved = noise(generator, (state.max() + 1, 2)) * [true.length, true.twist]
    long = (s.length - s.reference_length).numpy() + moved[state, 0]
    twist = s.twist.numpy() + moved[state, 1]
    pressure = s.pressure.numpy() + noise(generator, (len(state),)) * true.pressure
    error = noise(generator, (len(state), 2)) * [true.force, true.moment]
    right = np.stack([TRUE[2] * pressure - TRUE[0] * long, TRUE[3] * pressure - TRUE[1] * twist], axis=1)
    loads = right if extra is None else extra(s, right)
    return Bench(table, loads + error, error, state, moved)


def sensitivity(rows: int) -> Tensor:
    """∂(F, M)/∂(l, φ, P), (N, 2, 3)."""
    by = np.array([[-TRUE[0], 0.0, TRUE[2]], [0.0, -TRUE[1], TRUE[3]]])
    return torch.as_tensor(by).expand(rows, 2, 3).clone()


def jacobian(states: States) -> Tensor:
    """∂loads/∂(k, c, A, B), (N, 2, 4)."""
    none = torch.zeros(len(states), dtype=torch.float64)
    force = [states.reference_length - states.length, none, states.pressure, none]
    moment = [none, -states.twist, none, states.pressure]
    return torch.stack([torch.stack(force, -1), torch.stack(moment, -1)], dim=1)


def predicted(states: States) -> Tensor:
    """Loads (N, 2) at the true numbers."""
    return jacobian(states) @ torch.as_tensor(TRUE)
