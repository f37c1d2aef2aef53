"""States: what the bed imposed on which actuator, as SI tensors."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from freelearn.units import DEG, KPA, MM, NMM

if TYPE_CHECKING:
    import pandas as pd

# Time from one row to the next where the table has no time_s: the paper averages 20 readings at 1 Hz.
SECONDS_PER_ROW = 20.0
# Shear modulus of the wall [Pa] and C2 / C1, by which severities weigh pressure and fibers against stretch and twist.
# Nominal: their orders of magnitude are enough (of Ogden and Roxburgh's softening, severities of a third or of three
# times these fibers leave 2 % unexplained, these 1 %; without fibers it would be 30 %).
SHEAR_MODULUS, STIFFER = 1e6, 30.0
# Squares of hoop stretches that are looked at; beyond, a tube has burst.
LEAST_HOOP, MOST_HOOP, HOOP_ITERATIONS = 0.05, 9.0, 40


@dataclass(frozen=True)
class States:
    """N configurations of actuators: design, kinematic state and pressure. All tensors are (N,), float64.

    fiber_angle Γ [rad], reference_length L [m], inner_radius R_i [m], outer_radius R_o [m]: the unloaded design.
    length l [m], twist φ [rad], pressure P [Pa gauge]: the imposed state q = (l, φ) and the fluid's pressure.
    sample: the actuator's number (int64). direction: +1 where the pressure rose to reach the row, −1 where it
    fell, 0 for the first step of a kinematic state.

    What a row remembers, so that effects with a memory need nothing but the row itself: clock [s] since the sample's
    first row; dwell [s] since the first row of the kinematic state; severity of the row (see `severity`) and
    past_severity, the largest among the sample's rows so far, itself included. All zero unless given.
    """

    fiber_angle: Tensor
    reference_length: Tensor
    inner_radius: Tensor
    outer_radius: Tensor
    length: Tensor
    twist: Tensor
    pressure: Tensor
    sample: Tensor
    direction: Tensor
    clock: Tensor = None  # type: ignore[assignment]
    dwell: Tensor = None  # type: ignore[assignment]
    severity: Tensor = None  # type: ignore[assignment]
    past_severity: Tensor = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        for name in ("clock", "dwell", "severity", "past_severity"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, torch.zeros_like(self.length))

    def __len__(self) -> int:
        return self.length.shape[0]

    def __getitem__(self, rows: Tensor | slice) -> States:
        return States(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    def replace(self, **changes: Tensor) -> States:
        """The same states with some fields, each (N,), exchanged."""
        return replace(self, **changes)

    def detach(self) -> States:
        """The same states, cut from every derivative."""
        return States(**{f.name: getattr(self, f.name).detach() for f in fields(self)})

    def to(self, device: torch.device | str) -> States:
        """The same states on a device."""
        return States(**{f.name: getattr(self, f.name).to(device) for f in fields(self)})

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> States:
        """From a measurement table in engineering units, one row per configuration in the order of measuring.

        The memory (direction, clock, dwell, past_severity) is that of all rows given, buckled and left-out ones too.
        """

        def column(name: str, factor: float = 1.0) -> Tensor:
            return torch.as_tensor(table[name].to_numpy(dtype=np.float64) * factor)

        reference = column("length_mm", MM)
        return cls(
            fiber_angle=column("gamma_deg", DEG),
            reference_length=reference,
            inner_radius=column("inner_radius_mm", MM),
            outer_radius=column("outer_radius_mm", MM),
            length=reference + column("elongation_mm", MM),
            twist=column("twist_deg", DEG),
            pressure=column("pressure_kpa", KPA),
            sample=torch.tensor(table["sample"].to_numpy(dtype=np.int64)),
            direction=torch.as_tensor(pressure_direction(table)),
            **{name: torch.as_tensor(value) for name, value in _memory(table).items()},
        )


def measured_loads(table: pd.DataFrame) -> Tensor:
    """Measured force and moment of a table: (N, 2) N, N·m."""
    return torch.as_tensor(
        np.stack([table["force_n"].to_numpy(np.float64), table["moment_nmm"].to_numpy(np.float64) * NMM], axis=1)
    )


def kinematic_state(table: pd.DataFrame) -> np.ndarray:
    """Number of the kinematic state that each row belongs to: (N,) int64, in order of first appearance.

    A state is one visit of the bed to a length and twist: its rows share sample and twist, and `step` counts
    up in them. A repeat of a state later in the file is a visit, and so a state, of its own: it has its own
    position error. The length is left out of the comparison where the step keeps counting, because real beds
    creep while the pressure changes; a new count starts a new state.
    """
    sample, twist = table["sample"].to_numpy(), table["twist_deg"].to_numpy()
    elongation, step = table["elongation_mm"].to_numpy(), table["step"].to_numpy()
    new = np.ones(len(table), dtype=bool)
    same_place = (sample[1:] == sample[:-1]) & (twist[1:] == twist[:-1])
    counting = step[1:] > step[:-1]
    same_length = elongation[1:] == elongation[:-1]
    # Without a usable count (all steps equal) only an unchanged length keeps rows together.
    new[1:] = ~(same_place & (counting | (same_length & (step[1:] == step[:-1]))))
    return np.cumsum(new) - 1


def pressure_direction(table: pd.DataFrame) -> np.ndarray:
    """Sign of the pressure change that led to each row, (N,) float64: +1 rising, −1 falling, 0 at a first step."""
    state = kinematic_state(table)
    pressure = table["pressure_kpa"].to_numpy(dtype=np.float64)
    direction = np.zeros(len(table))
    direction[1:] = np.where(state[1:] == state[:-1], np.sign(np.diff(pressure)), 0.0)
    return direction


def severity(table: pd.DataFrame) -> np.ndarray:
    """How hard each row works the wall, dimensionless, (N,) float64: what earlier stretching is measured by.

    The energy that a thin tube of the wall's mean radius R and thickness t stores, over its shear modulus / 2: with the
    hoop stretch √q, the stretch λ, ρ = R φ/L and the paper's energy, S = 1/(λ²q) + (1 + ρ²) q + λ² − 3 + k (I₄ − 1)²,
    I₄ = q (sin Γ + ρ cos Γ)² + λ² cos² Γ. q is the one at which the wall balances the pressure: ∂S/∂q = P R λ/(t C1).
    """
    length, inner, outer = (
        table[name].to_numpy(np.float64) * MM for name in ("length_mm", "inner_radius_mm", "outer_radius_mm")
    )
    angle, radius = table["gamma_deg"].to_numpy(np.float64) * DEG, (inner + outer) / 2
    axial = (1 + table["elongation_mm"].to_numpy(np.float64) * MM / length) ** 2
    shear = radius * table["twist_deg"].to_numpy(np.float64) * DEG / length
    along, across = axial * np.cos(angle) ** 2, (np.sin(angle) + shear * np.cos(angle)) ** 2
    push = table["pressure_kpa"].to_numpy(np.float64) * KPA * radius * axial**0.5 / (outer - inner) / SHEAR_MODULUS
    hoop = np.full(len(table), LEAST_HOOP)
    for _ in range(HOOP_ITERATIONS):
        # Rising and concave from the left of its zero: Newton's method never passes it.
        slope = -1 / (axial * hoop**2) + 1 + shear**2 + 2 * STIFFER * across * (hoop * across + along - 1) - push
        hoop = (hoop - slope / (2 / (axial * hoop**3) + 2 * STIFFER * across**2)).clip(LEAST_HOOP, MOST_HOOP)
    values: np.ndarray = (
        1 / (axial * hoop) + (1 + shear**2) * hoop + axial - 3 + STIFFER * (hoop * across + along - 1) ** 2
    )
    return values


def _memory(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """clock, dwell [s], severity and past_severity of every row, each (N,) float64."""
    sample, state, order = table["sample"].to_numpy(), kinematic_state(table), np.arange(len(table))
    if "time_s" in table:
        time = table["time_s"].to_numpy(np.float64)
        clock, dwell = time - time[_first(sample)], time - time[_first(state)]
    else:
        rows_of_sample = np.empty(len(table))
        for number in np.unique(sample):
            rows = sample == number
            rows_of_sample[rows] = np.arange(rows.sum())
        clock, dwell = SECONDS_PER_ROW * rows_of_sample, SECONDS_PER_ROW * (order - _first(state))
    now = severity(table)
    past = np.empty(len(table))
    for number in np.unique(sample):
        rows = sample == number
        past[rows] = np.maximum.accumulate(now[rows])
    return {"clock": clock, "dwell": dwell, "severity": now, "past_severity": past}


def _first(group: np.ndarray) -> np.ndarray:
    """Place of the first row of each row's group, (N,)."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return first[inverse]
