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
from freelearn.fitting.levenberg_marquardt import Function, LevenbergMarquardt
from freelearn.fitting.rubber_tests import Part, Recorded, parts_of, together
from freelearn.fitting.solver import Result, Termination
from freelearn.fitting.starts import START_DECADES
from freelearn.fitting.uncertainty import RANK_TOLERANCE, interval
from freelearn.physics.chain.model import Values
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.mechanics.energy import MPA
from freelearn.physics.models.rubber import Rubber

# Starts tried for an effect's parameter: no effect, and its own start times these.
FACTORS = (0.01, 0.1, 1.0, 10.0)
# Searches that run to their end, from the best places of the grid; of 8, none finds the minimum of three effects.
MEMBERS = 32
# Of recordings, whose energy and arms have their minimum from nearly any start.
MEMBERS_IN_TIME = 4
# Places of the grid at once.
AT_ONCE = 128
# Of misfits that hardly change from one sample to the next no more is known of how few they are.
MOST_ALIKE = 0.99
# A search that finds the minimum does so in about twenty steps.
ITERATIONS = 200
TOLERANCE = 1e-10


@dataclass(frozen=True)
class ModeError:
    """error: root mean square of the misfit over the test's largest stress. n: stresses. fitted: or held out.

    The error is not finite where the fitted energy has no stress at a stretch held out (beyond limited chains).
    """

    error: float
    n: int
    fitted: bool


@dataclass(frozen=True)
class RubberFit:
    """values, stderr: by parameter, in SI; stderr NaN for a parameter at a bound or undetermined. intervals: 95 %, SI,
    within the bounds, NaN where stderr is.

    error: over all fitted stresses, as in ModeError. at_bound: parameters that the fit left on a bound. modes: by the
    name of a test: its mode or, of a recording, its specimen.
    """

    rubber: Rubber
    values: dict[str, float]
    stderr: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    at_bound: list[str]
    error: float
    modes: dict[str, ModeError]
    message: str


def fit_rubber(
    rubber: Rubber, table: pd.DataFrame, held_out: Sequence[str] = (), start: RubberFit | None = None
) -> RubberFit:
    """Fits all tests of a table (of read_specimens) together but those held out, modes or recordings by name.

    Minimizes Σ ((P̂ − P)/P_max)² over the fitted stresses, P_max the largest |P| of their test, so that every test
    counts by its shape and number of stresses, not by their size. Standard errors are s² (JᵀJ)⁻¹, which takes the
    misfits of neighbors as independent; along recordings, where they are not, they are widened by what correlation
    neighbors have. Other parameters' are those at the bound where one sits on a bound. The start is looked for on a
    grid, or that of another fit of this rubber. Raises UserError where too few stresses or no tests are left to fit.
    """
    data = parts_of(table)
    fitted = to_fit(list(data), held_out)
    count = sum(len(part.stress) for name in fitted for part in data[name])
    if count < len(rubber.declared):
        raise UserError(
            f"{count} stresses cannot determine {len(rubber.declared)} parameters: add rows or drop effects."
        )
    parts = together(table, fitted)

    def residual(vector: Tensor) -> Tensor:
        values = rubber.physical(vector)
        return torch.cat([part.misfit(rubber, values) for part in parts])

    lower, upper = rubber.bounds()
    search = LevenbergMarquardt(
        residual,
        _rates(residual),
        lower=lower,
        upper=upper,
        gtol=TOLERANCE,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        max_iterations=ITERATIONS,
    )
    unloaded = sum(float((part.stress / part.largest).square().sum()) for part in parts)
    result = search.solve(_starts(rubber, residual, unloaded) if start is None else rubber.raw(start.values)[None])
    best = result.member(int(result.loss.nan_to_num(nan=math.inf).argmin()))
    if best.status == Termination.INVALID_START:
        names = ", ".join(effect.name for effect in rubber.effects)
        raise UserError(f"No start gives finite stresses with effects {names}: look at the largest stretches.")
    values = rubber.physical(best.x)
    modes = {}
    for name, own in data.items():
        misfit = torch.cat([part.misfit(rubber, values) for part in own])
        modes[name] = ModeError(float(misfit.square().mean().sqrt()), len(misfit), name in fitted)
    bound = (best.x <= lower) | (best.x >= upper)
    stderr = _standard_errors(rubber, best, ~bound) * _widened(rubber, values, parts)
    declared = list(rubber.declared.values())
    freedom = max(count - len(values), 1)
    ends = interval([float(value) for value in values.values()], stderr, [p.log for p in declared], freedom)
    ends = np.clip(ends, [p.lower for p in declared], [p.upper for p in declared])
    found = {
        name: (float(value), float(error), (float(low), float(high)), bool(at))
        for (name, value), error, low, high, at in zip(values.items(), stderr, *ends, bound, strict=True)
    }
    # Arms are told in the order of their times: in a search any two may change places.
    order = rubber.relaxation.order({name: own[0] for name, own in found.items()})
    found |= {name: found[was] for name, was in zip(rubber.relaxation.declared, order, strict=True)}
    return RubberFit(
        rubber,
        {name: own[0] for name, own in found.items()},
        {name: own[1] for name, own in found.items()},
        {name: own[2] for name, own in found.items()},
        [name for name, own in found.items() if own[3]],
        math.sqrt(float(best.loss) / count),
        modes,
        best.message(),
    )


def predicted(fit: RubberFit, rows: pd.DataFrame) -> pd.DataFrame:
    """The rows of one recording with the stresses of a fit in the directions that were measured, blank in others."""
    values = {name: torch.tensor(value, dtype=torch.float64) for name, value in fit.values.items()}
    stresses = {}
    for name, second in (("stress_mpa", False), ("stress_2_mpa", True)):
        asked = Recorded.from_tests([rows], second)
        stresses[name] = (asked.predicted(fit.rubber, values) / MPA).numpy() if asked.there.any() else math.nan
    return rows.assign(**stresses)


def to_fit(modes: Sequence[str], held_out: Sequence[str]) -> list[str]:
    """Those of the tests that are not held out. Raises UserError where one that is held out is none of them, and where
    all are."""
    for mode in held_out:
        if mode not in modes:
            raise UserError(f"Test {mode} cannot be held out: the data hold {', '.join(modes)}.")
    fitted = [mode for mode in modes if mode not in held_out]
    if not fitted:
        raise UserError("Every test is held out, so nothing is left to fit: hold fewer out.")
    return fitted


def _starts(rubber: Rubber, residual: Function, unloaded: float) -> Tensor:
    """Raw starts (members, p): the places of a grid with the smallest loss, each with its own effects' values.

    unloaded: the loss of stresses that are all zero. A place no better than that lies beyond a pole of the energy
    (a stretch that the chains cannot reach), from where a search wanders without end.
    """
    arms = rubber.relaxation.declared
    axes = [torch.stack([p.to_raw(v) for v in _candidates(name, p)]) for name, p in list(rubber.declared.items())[1:]]
    moduli = START_DECADES * math.log(10)
    places = torch.cartesian_prod(*axes).reshape(-1, len(axes)) if axes else torch.zeros(1, 0, dtype=torch.float64)
    grid = torch.cat([moduli.repeat(len(places))[:, None], places.repeat_interleave(len(moduli), 0)], dim=1)
    # Arms begin as stiff as the rubber is at rest.
    stiff = [place for place, name in enumerate(rubber.declared) if name in arms and name.endswith(".modulus")]
    grid[:, stiff] = grid[:, :1].clone()
    loss = torch.func.vmap(residual, chunk_size=AT_ONCE)(grid).square().sum(-1)
    loss = loss.nan_to_num(nan=math.inf, posinf=math.inf)
    lowest, modulus = loss.reshape(len(places), len(moduli)).min(-1)
    members = MEMBERS_IN_TIME if arms else MEMBERS
    order = lowest.argsort()[: min(members, max(1, int((lowest < unloaded).sum())))]
    return grid.reshape(len(places), len(moduli), -1)[order, modulus[order]]


def _rates(residual: Function) -> Function:
    """∂r/∂x of it, from (p,) to (m, p), by two passes in reverse, of which the second is linear in the first's weights.

    Forward, torch 2.13 asks Python for the shape of each product with a constant, twenty times what the product takes.
    """

    def jacobian(vector: Tensor) -> Tensor:
        misfit, weigh, *_ = torch.func.vjp(residual, vector)
        _, along, *_ = torch.func.vjp(lambda weight: weigh(weight)[0], torch.zeros_like(misfit))
        unit = torch.eye(len(vector), dtype=vector.dtype)
        columns: Tensor = torch.func.vmap(lambda direction: along(direction)[0], out_dims=1)(unit)
        return columns

    return jacobian


def _candidates(name: str, p: Parameter) -> list[float]:
    """Values of a parameter worth starting from, within its bounds: those of arms are found from nearly anywhere."""
    if name.startswith("arm"):
        return [p.start]
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


def _widened(rubber: Rubber, values: Values, parts: Sequence[Part]) -> float:
    """By how much standard errors of independent misfits are too small: (1 + ρ)/(1 − ρ) in squares of misfits that
    have a correlation ρ with the next one of their recording (Bartlett 1946)."""
    misfits = [part.misfit(rubber, values) for part in parts]
    squares = sum(float(misfit.square().sum()) for misfit in misfits)
    products = sum(part.neighbors(misfit) for part, misfit in zip(parts, misfits, strict=True))
    correlation = min(max(products / squares, 0.0), MOST_ALIKE) if squares else 0.0
    return math.sqrt((1 + correlation) / (1 - correlation))
