"""Fitting a rubber's energies to its tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.specimen_schema import MODES, Stresses
from freelearn.fitting.levenberg_marquardt import Function, LevenbergMarquardt
from freelearn.fitting.solver import Result, Termination
from freelearn.fitting.starts import START_DECADES
from freelearn.fitting.uncertainty import RANK_TOLERANCE
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.mechanics.energy import MPA
from freelearn.physics.models.rubber import Rubber

# Starts tried for an effect's parameter: no effect, and its own start times these.
FACTORS = (0.01, 0.1, 1.0, 10.0)
# Searches that run to their end, from the best places of the grid; of 8, none finds the minimum of three effects.
MEMBERS = 32
# A search that finds the minimum does so in about twenty steps.
ITERATIONS = 200
TOLERANCE = 1e-10


@dataclass(frozen=True)
class ModeError:
    """error: root mean square of the misfit over the mode's largest stress. n: stresses. fitted: or held out.

    The error is not finite where the fitted energy has no stress at a stretch held out (beyond limited chains).
    """

    error: float
    n: int
    fitted: bool


@dataclass(frozen=True)
class RubberFit:
    """values, stderr: by parameter, in SI; stderr NaN for a parameter at a bound or undetermined.

    error: over all fitted stresses, as in ModeError. at_bound: parameters that the fit left on a bound.
    """

    rubber: Rubber
    values: dict[str, float]
    stderr: dict[str, float]
    at_bound: list[str]
    error: float
    modes: dict[str, ModeError]
    message: str


def fit_rubber(rubber: Rubber, table: pd.DataFrame, held_out: Sequence[str] = ()) -> RubberFit:
    """Fits all modes of a table (of read_specimens) together but those held out.

    Minimizes Σ ((P̂ − P)/P_max)² over the fitted stresses, P_max the largest |P| of their mode, so that every mode
    counts by its shape and number of stresses, not by their size. Standard errors are s² (JᵀJ)⁻¹, which takes the
    misfits of neighbors as independent; other parameters' are those at the bound where one sits on a bound.
    The start is looked for on a grid. Raises UserError where too few stresses or no modes are left to fit.
    """
    data = {mode: _Measured.from_table(table[table["mode"] == mode]) for mode in MODES if (table["mode"] == mode).any()}
    fitted = _fitted(list(data), held_out)
    count = sum(len(data[mode].stress) for mode in fitted)
    if count < len(rubber.declared):
        raise UserError(
            f"{count} stresses cannot determine {len(rubber.declared)} parameters: add rows or drop effects."
        )

    def residual(vector: Tensor) -> Tensor:
        values = rubber.physical(vector)
        return torch.cat([data[mode].misfit(rubber, values) for mode in fitted])

    lower, upper = rubber.bounds()
    search = LevenbergMarquardt(
        residual,
        lower=lower,
        upper=upper,
        gtol=TOLERANCE,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        max_iterations=ITERATIONS,
    )
    unloaded = sum(float((data[mode].stress / data[mode].largest).square().sum()) for mode in fitted)
    result = search.solve(_starts(rubber, residual, unloaded))
    best = result.member(int(result.loss.nan_to_num(nan=math.inf).argmin()))
    if best.status == Termination.INVALID_START:
        names = ", ".join(effect.name for effect in rubber.effects)
        raise UserError(f"No start gives finite stresses with effects {names}: look at the largest stretches.")
    values = rubber.physical(best.x)
    modes = {}
    for mode, measured in data.items():
        misfit = measured.misfit(rubber, values)
        modes[mode] = ModeError(float(misfit.square().mean().sqrt()), len(misfit), mode in fitted)
    bound = ((best.x <= lower) | (best.x >= upper)).tolist()
    return RubberFit(
        rubber,
        {name: float(value) for name, value in values.items()},
        dict(zip(rubber.declared, _standard_errors(rubber, best, ~torch.tensor(bound)), strict=True)),
        [name for name, at in zip(rubber.declared, bound, strict=True) if at],
        math.sqrt(float(best.loss) / count),
        modes,
        best.message(),
    )


@dataclass(frozen=True)
class _Measured:
    """One mode's stresses [Pa] and the stretches along and across them, each (N,)."""

    along: Tensor
    across: Tensor
    stress: Tensor

    @classmethod
    def from_table(cls, rows: pd.DataFrame) -> _Measured:
        held = Stresses.from_table(rows)
        return cls(torch.tensor(held.along), torch.tensor(held.across), torch.tensor(held.stress_mpa) * MPA)

    def misfit(self, rubber: Rubber, values: dict[str, Tensor]) -> Tensor:
        """(P̂ − P)/P_max, (N,)."""
        return (rubber.stress(values, self.along, self.across) - self.stress) / self.largest

    @property
    def largest(self) -> Tensor:
        return self.stress.abs().max()


def _fitted(modes: Sequence[str], held_out: Sequence[str]) -> list[str]:
    for mode in held_out:
        if mode not in modes:
            raise UserError(f"Mode {mode} cannot be held out: the data hold {', '.join(modes)}.")
    fitted = [mode for mode in modes if mode not in held_out]
    if not fitted:
        raise UserError("Every mode is held out, so nothing is left to fit: hold fewer out.")
    return fitted


def _starts(rubber: Rubber, residual: Function, unloaded: float) -> Tensor:
    """Raw starts (members, p): the places of a grid with the smallest loss, each with its own effects' values.

    unloaded: the loss of stresses that are all zero. A place no better than that lies beyond a pole of the energy
    (a stretch that the chains cannot reach), from where a search wanders without end.
    """
    declared = list(rubber.declared.values())
    axes = [torch.stack([p.to_raw(v) for v in _candidates(p)]) for p in declared[1:]]
    moduli = START_DECADES * math.log(10)
    places = torch.cartesian_prod(*axes).reshape(-1, len(axes)) if axes else torch.zeros(1, 0, dtype=torch.float64)
    grid = torch.cat([moduli.repeat(len(places))[:, None], places.repeat_interleave(len(moduli), 0)], dim=1)
    loss = torch.func.vmap(residual)(grid).square().sum(-1).nan_to_num(nan=math.inf, posinf=math.inf)
    lowest, modulus = loss.reshape(len(places), len(moduli)).min(-1)
    order = lowest.argsort()[: min(MEMBERS, max(1, int((lowest < unloaded).sum())))]
    return grid.reshape(len(places), len(moduli), -1)[order, modulus[order]]


def _candidates(p: Parameter) -> list[float]:
    """Values of an effect's parameter worth starting from, within its bounds."""
    sizes = [factor * abs(p.start) for factor in FACTORS]
    values = [p.start if p.none is None else p.none, *sizes, *(-size for size in sizes)]
    return sorted({value for value in values if p.allows(value)})


def _standard_errors(rubber: Rubber, at: Result, free: Tensor) -> np.ndarray:
    """(p,), in SI; NaN for parameters that are not free or that the rows do not determine."""
    jacobian = at.jacobian[:, free]
    # Columns scaled to length one, so that units do not decide what counts as undetermined.
    length = jacobian.norm(dim=0)
    moved = length > 0
    _, singular, right = torch.linalg.svd(jacobian / torch.where(moved, length, 1.0), full_matrices=False)
    strong = singular > RANK_TOLERANCE * singular.max()
    half = right[strong].T / singular[strong] / torch.where(moved, length, 1.0)[:, None]
    freedom = max(len(jacobian) - int(strong.sum()), 1)
    known = moved & ((right[~strong] ** 2).sum(0) < 1e-6)
    error = torch.where(known, half.norm(dim=1) * (at.loss / freedom).sqrt(), math.nan)
    raw = torch.full_like(at.x, math.nan)
    raw[free] = error
    slope = torch.func.jacfwd(lambda x: torch.stack(list(rubber.physical(x).values())))(at.x).diagonal()
    errors: np.ndarray = (raw * slope).numpy()
    return errors
