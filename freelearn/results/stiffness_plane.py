"""The tangent stiffness of a fitted model, over elongation and twist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.measurements.beds import ELONGATION, KINEMATIC, PRESSURE, TWIST, Pair
from freelearn.measurements.states import States
from freelearn.models.base import BLOCK
from freelearn.models.prediction import Prediction, Status
from freelearn.models.row_derivatives import rows_jacobian
from freelearn.models.row_systems import determinant
from freelearn.results.fitted_model import FittedModel
from freelearn.results.map_scope import fitted_samples, load_notes, lost_note, refused, samples_known, tells_loads
from freelearn.results.reached import Ends, Reached
from freelearn.results.settled import settled
from freelearn.results.stiffness_map import StiffnessMap
from freelearn.results.stiffness_rates import FACTORS, RATES

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
    reached = Reached.of(predictions)
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


def _grid(reached: Reached, length_mm: float) -> tuple[Pair, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
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


def _asked(reached: Reached, pressure_kpa: float | Sequence[float] | None) -> dict[str, np.ndarray]:
    """Pressures (1, k) kPa by what they are called."""
    if pressure_kpa is None and not (reached.low < reached.high).any():
        return {"within reach": reached.low[None]}
    if pressure_kpa is None:
        return {name: (reached.low + s * (reached.high - reached.low))[None] for name, s in SHARES.items()}
    given = np.atleast_1d(np.asarray(pressure_kpa, dtype=np.float64))
    if len(given) not in (1, len(reached.low)):
        raise UserError(f"{len(given)} pressures for {len(reached.low)} actuators: give one for each, or one for all.")
    return {"given": np.broadcast_to(given, reached.low.shape)[None]}


def _plane(reached: Reached, pressed: np.ndarray, lengths: np.ndarray, twists: np.ndarray) -> pd.DataFrame:
    """Every combination of elongations, twists and pressures (p, k), the first changing last."""
    length, twist, step = (
        axis.ravel() for axis in np.meshgrid(lengths, twists, np.arange(len(pressed)), indexing="ij")
    )
    each = {q.column: pressed[step, i] for i, q in enumerate(reached.quantities)}
    return pd.DataFrame({ELONGATION.column: length, TWIST.column: twist, **each})


def _rates(fitted: FittedModel, rows: pd.DataFrame) -> pd.DataFrame:
    states = settled(fitted, rows, KINEMATIC)
    stiffness, status = _stiffness(fitted, states)
    ok = (status == Status.OK).numpy()
    each = {
        rate.column: np.where(ok, stiffness[:, i // 2, i % 2].numpy() / factor, np.nan)
        for i, (rate, factor) in enumerate(zip(RATES, FACTORS, strict=True))
    }
    # Positive where determinant and trace are: there models.hang lets an actuator under a dead load come to rest.
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
