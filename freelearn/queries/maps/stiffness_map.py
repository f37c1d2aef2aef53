"""How stiff an actuator is, over the plane of its poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import DEG, ELONGATION, KINEMATIC, MM, NMM, PRESSURE, TWIST, Pair
from freelearn.data.states import States
from freelearn.physics.chain.model import BLOCK
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.chain.row_derivatives import determinant, rows_jacobian
from freelearn.queries.curves.curve_rows import pressures
from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.maps.map_scope import (
    Ends,
    OperatingRange,
    fitted_samples,
    load_notes,
    lost_note,
    refused,
    samples_known,
    steady_states,
    tells_loads,
)


@dataclass(frozen=True)
class Rate:
    """An entry of the stiffness. column: of StiffnessMap.table; signed: whether zero is the middle of its scale."""

    name: str
    symbol: str
    column: str
    unit: str
    signed: bool = False

    @property
    def label(self) -> str:
        """For a color bar: axial stiffness −∂F/∂l [N/mm]."""
        return f"{self.name} {self.symbol} [{self.unit}]"


AXIAL = Rate("axial stiffness", "−∂F/∂l", "axial_n_per_mm", "N/mm")
TORSIONAL = Rate("torsional stiffness", "−∂M/∂φ", "torsional_nmm_per_deg", "N·mm/°")
COUPLING = Rate("coupling", "−∂F/∂φ", "coupling_n_per_deg", "N/°", signed=True)
BACK = Rate("coupling back", "−∂M/∂l", "coupling_nmm_per_mm", "N·mm/mm", signed=True)
# As ∂(F, M)/∂(l, φ) has them, row by row; and the factors of their units to SI.
RATES = (AXIAL, COUPLING, BACK, TORSIONAL)
FACTORS = (1 / MM, 1 / DEG, NMM / MM, NMM / DEG)


# What differs by less than this share of the largest is the same, but for rounding.
SAME = 1e-6


@dataclass(frozen=True)
class Panel:
    """A sample's plane. name: its pressures, "" where they are a quantity of the plane; rows: its part of the table, by
    the first quantity of the plane and then the second, rising."""

    sample: int
    name: str
    rows: pd.DataFrame


@dataclass(frozen=True)
class StiffnessMap:
    """table: sample, at (lowest, middle, highest, given or within reach), elongation_mm, twist_deg, each pressure,
    pressure_kpa (of several their mean), the four RATES, least_nm_per_rad, stable, status.

    least_nm_per_rad: least eigenvalue of the stiffness, lengths counted in reference lengths. stable: 1 where that is
    positive, so that the actuator stays there under a dead load, 0 where not. All blank without an equilibrium. over:
    the two quantities of the plane: elongation and twist, or, where the bed held one of them, the other and the
    pressure. fitted: samples of the training set. notes: what a reader should know.
    """

    table: pd.DataFrame
    over: Pair
    fitted: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def rates(self) -> tuple[Rate, ...]:
        """The entries that tell something: where the model is conservative, the coupling is the same both ways."""
        if self.uncoupled:
            return AXIAL, TORSIONAL
        return (AXIAL, TORSIONAL, COUPLING) if self.symmetric else (AXIAL, TORSIONAL, COUPLING, BACK)

    @property
    def symmetric(self) -> bool:
        """Whether ∂F/∂φ = ∂M/∂l everywhere, but for rounding."""
        forth, back = self._couplings().T
        return bool(np.nanmax(np.abs(forth - back), initial=0.0) <= SAME * self._size())

    @property
    def uncoupled(self) -> bool:
        """Whether both are zero everywhere: so of a braid of two like families that is not turned."""
        return bool(np.nanmax(np.abs(self._couplings()), initial=0.0) <= SAME * self._size())

    @property
    def ats(self) -> list[str]:
        """The pressures that are told apart, in order."""
        return list(dict.fromkeys(self.table["at"]))

    def panels(self) -> Iterator[Panel]:
        """Every plane: sample by sample, and of each one the pressures."""
        for (sample, _), rows in self.table.groupby(["sample", "at"], sort=False):
            values = [f"{q.symbol} = {float(rows[q.column].iloc[0]):.3g}" for q in pressures(self.table)]
            name = "" if PRESSURE in self.over else f"{', '.join(values)} kPa".replace("-", "−")
            yield Panel(int(str(sample)), name, rows.reset_index(drop=True))

    def at(self, name: str) -> StiffnessMap:
        """The part at one of `ats`."""
        rows = self.table[self.table["at"] == name].reset_index(drop=True)
        return StiffnessMap(rows, self.over, self.fitted, self.notes)

    def _couplings(self) -> np.ndarray:
        """∂F/∂φ and ∂M/∂l, (N, 2) N."""
        values: np.ndarray = self.table[[COUPLING.column, BACK.column]].to_numpy() * (FACTORS[1], FACTORS[2])
        return values

    def _size(self) -> float:
        """What a coupling is small against, N: the geometric mean of the other two, or the coupling itself."""
        axial, torsional = (float(np.nan_to_num(self.table[r.column].abs().max())) for r in (AXIAL, TORSIONAL))
        mean = float(np.sqrt(axial * FACTORS[0] * torsional * FACTORS[3]))
        return max(mean, float(np.nanmax(np.abs(self._couplings()), initial=0.0)))


# The tangent stiffness of a fitted model, over elongation and twist.

# Places along either quantity of the plane.
PLACES = 41
# Shares of the pressures' reach at which a plane is mapped.
SHARES = {"lowest": 0.0, "middle": 0.5, "highest": 1.0}
# Of its own length on either side of where the bed stood still.
LEAST = 0.01


def stiffness_map(
    fitted: FittedModel, pressure_kpa: float | Sequence[float] | None = None, samples: Sequence[int] | None = None
) -> StiffnessMap:
    """−∂(F, M)/∂(l, φ) over the elongations and twists that the run's bed went to, at a pressure.

    pressure_kpa: one for all actuators, or one for each; None for the lowest, the middle and the highest within reach.
    Where the bed held elongation or twist, the pressure within reach takes its place in the plane. Raises UserError.
    """
    if not tells_loads(fitted):
        raise refused(fitted)
    predictions = fitted.table()
    reached = OperatingRange.from_predictions(predictions)
    over, lengths, twists, pressed = _grid(reached, float(fitted.design["length_mm"].min()))
    if PRESSURE not in over:
        pressed = _asked(reached, pressure_kpa)
    parts = [
        _plane(reached, values, lengths, twists).assign(sample=number, at=name)
        for number in samples_known(fitted, samples)
        for name, values in pressed.items()
    ]
    rows = pd.concat(parts, ignore_index=True)
    rows["pressure_kpa"] = rows[[q.column for q in reached.quantities]].mean(axis=1)
    first = ["sample", "at", "elongation_mm", "twist_deg"]
    rows = rows[[*first, *(name for name in rows if name not in first)]]
    table = _rates(fitted, rows)
    notes = (*load_notes(fitted), *lost_note(table, "no equilibrium"))
    found = StiffnessMap(table, over, fitted_samples(fitted, predictions), notes)
    return replace(found, notes=(*notes, "Elongation and twist are not coupled here.")) if found.uncoupled else found


def _grid(reached: OperatingRange, length_mm: float) -> tuple[Pair, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """The plane, elongations [mm] and twists [°], and the pressures (p, k) kPa where these are one of its axes."""
    pressed = {"within reach": np.linspace(reached.low, reached.high, PLACES)}
    lengths, twists = _steps(reached.elongation), _steps(reached.twist)
    if len(lengths) > 1 and len(twists) > 1:
        return (ELONGATION, TWIST), lengths, twists, {}
    if not (reached.low < reached.high).any():
        pressed = {"within reach": np.linspace(reached.low, reached.high + 1.0, PLACES)}
    if len(twists) > 1:
        return (TWIST, PRESSURE), lengths, twists, pressed
    if len(lengths) == 1:
        room = LEAST * length_mm
        lengths = np.linspace(lengths[0] - room, lengths[0] + room, PLACES)
    return (ELONGATION, PRESSURE), lengths, twists, pressed


def _steps(ends: Ends) -> np.ndarray:
    return np.unique(np.linspace(*ends, PLACES))


def _asked(reached: OperatingRange, pressure_kpa: float | Sequence[float] | None) -> dict[str, np.ndarray]:
    """Pressures (1, k) kPa by what they are called."""
    if pressure_kpa is None and not (reached.low < reached.high).any():
        return {"within reach": reached.low[None]}
    if pressure_kpa is None:
        return {name: (reached.low + s * (reached.high - reached.low))[None] for name, s in SHARES.items()}
    given = np.atleast_1d(np.asarray(pressure_kpa, dtype=np.float64))
    if len(given) not in (1, len(reached.low)):
        raise UserError(f"{len(given)} pressures for {len(reached.low)} actuators: give one for each, or one for all.")
    return {"given": np.broadcast_to(given, reached.low.shape)[None]}


def _plane(reached: OperatingRange, pressed: np.ndarray, lengths: np.ndarray, twists: np.ndarray) -> pd.DataFrame:
    """Every combination of elongations, twists and pressures (p, k), the first changing last."""
    length, twist, step = (
        axis.ravel() for axis in np.meshgrid(lengths, twists, np.arange(len(pressed)), indexing="ij")
    )
    each = {q.column: pressed[step, i] for i, q in enumerate(reached.quantities)}
    return pd.DataFrame({ELONGATION.column: length, TWIST.column: twist, **each})


def _rates(fitted: FittedModel, rows: pd.DataFrame) -> pd.DataFrame:
    states = steady_states(fitted, rows, KINEMATIC)
    stiffness, status = _stiffness(fitted, states)
    ok = (status == Status.OK).numpy()
    each = {
        rate.column: np.where(ok, stiffness[:, i // 2, i % 2].numpy() / factor, np.nan)
        for i, (rate, factor) in enumerate(zip(RATES, FACTORS, strict=True))
    }
    # Positive where determinant and trace are: there dead_load lets an actuator under a dead load come to rest.
    size = states.reference_length
    mean = (size**2 * stiffness[:, 0, 0] + stiffness[:, 1, 1]) / 2
    least = mean - (mean**2 - size**2 * determinant(stiffness)).clamp_min(0.0).sqrt()
    stable = np.where(ok, (least > 0).numpy(), np.nan)
    words = np.array([s.name.lower() for s in Status])[status.numpy()]
    return rows.assign(**each, least_nm_per_rad=np.where(ok, least.numpy(), np.nan), stable=stable, status=words)


def _stiffness(fitted: FittedModel, states: States) -> tuple[Tensor, Tensor]:
    """−∂(F, M)/∂(l, φ) of every state, (N, 2, 2) SI, and the status of its loads, (N,)."""
    model = fitted.model
    values = {name: value.detach() for name, value in model.values().items()}
    rates, statuses = [], []
    for part in torch.arange(len(states)).split(BLOCK):
        block = states[part]
        said: list[Prediction] = []

        def loads(q: Tensor, block: States = block, said: list[Prediction] = said) -> Tensor:
            said.append(model.chain(block.replace(length=q[:, 0], twist=q[:, 1]), values))
            return said[-1].loads

        rates.append(-rows_jacobian(loads, torch.stack([block.length, block.twist], dim=-1))[1])
        statuses.append(said[-1].status)
    return torch.cat(rates), torch.cat(statuses)
