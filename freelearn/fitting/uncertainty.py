"""How well a fit knows its parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike
from scipy.special import stdtrit
from torch import Tensor

from freelearn.fitting.finish import least_squares_part
from freelearn.fitting.options import NORMAL
from freelearn.fitting.problem import Problem, Pull
from freelearn.fitting.trust_region import reduced
from freelearn.physics.chain.model import Model


def groups(key: np.ndarray) -> np.ndarray:
    """0, 1, … for each row's key, (N,) int64, in the order of the keys: np.unique's inverse.

    >>> groups(np.array([4, 4, 7])), groups(np.array([7, 4, 7]))
    (array([0, 0, 1]), array([1, 0, 1]))
    """
    number: np.ndarray
    # As kinematic states are numbered; sorting them takes four times the memory.
    if len(key) and bool((key[1:] >= key[:-1]).all()):
        number = np.zeros(len(key), dtype=np.int64)
        np.cumsum(key[1:] != key[:-1], out=number[1:])
        return number
    number = np.unique(key, return_inverse=True)[1]
    return number


# How well a fit determines its parameters.

# Directions whose effect on the residuals is this much weaker than the strongest one's count as undetermined.
RANK_TOLERANCE = 1e-9
# Square of a parameter's share in such directions from which it is undetermined itself.
DETERMINED = 1e-6
# Probability that an interval covers the true value.
COVERAGE = 0.95


@dataclass(frozen=True)
class Uncertainty:
    """values, stderr, stderr_independent, low, high: (p,), physical units; NaN where the rows do not determine a
    parameter.

    stderr allows any correlation among the rows of one kinematic state (they share a position error) and any
    size of the misfit: the cluster-robust sandwich estimate (Liang & Zeger 1986). stderr_independent is the textbook
    one, s² (JᵀJ)⁻¹, that lmfit and SciPy users know; it is right only if all residuals are independent.
    low, high: ends of the 95 % intervals: see `interval`, or fit.profile, where an end may be infinite. freedom:
    kinematic states less parameters, at least 1; what Student's t has in those intervals. covariance: (p, p), the one
    behind `stderr`. chi_square: sum of squared residuals of n readings, two a row where none is blank. rows: that have
    a reading. kinds: normal or profile, of each interval; words: what should be known of each, "" for nothing; remark:
    of all of them.
    """

    names: list[str]
    values: np.ndarray
    stderr: np.ndarray
    stderr_independent: np.ndarray
    low: np.ndarray
    high: np.ndarray
    freedom: int
    covariance: np.ndarray
    chi_square: float
    residuals: int
    rows: int
    kinds: list[str] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    remark: str = ""

    def __post_init__(self) -> None:
        """Fills in what is not said: normal intervals, of which nothing is to be known."""
        object.__setattr__(self, "kinds", self.kinds or [NORMAL] * len(self.names))
        object.__setattr__(self, "words", self.words or [""] * len(self.names))


def quantile(freedom: float) -> float:
    """Standard errors from an estimate to either end of its 95 % interval: Student's t with `freedom` ≥ 1.

    >>> [round(quantile(freedom), 3) for freedom in (1, 4, 1000)]
    [12.706, 2.776, 1.962]
    """
    return float(stdtrit(freedom, (1 + COVERAGE) / 2))


def interval(values: ArrayLike, stderr: ArrayLike, log: ArrayLike, freedom: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % intervals of estimates: two arrays, NaN where a standard error is.

    values, stderr: (p,), in one unit. log: (p,) bool, parameters whose logarithm was fitted: theirs is the interval
    on that scale, value·exp(±t·stderr/value), which never reaches zero; the others' is value ± t·stderr. t is
    Student's with `freedom`, because a standard error that few kinematic states tell is itself uncertain.

    >>> low, high = interval([2.0, 2.0], [0.5, 0.5], [False, True], 4)
    >>> low.round(3).tolist(), high.round(3).tolist()
    ([0.612, 0.999], [3.388, 4.004])
    """
    return ends(values, quantile(freedom) * np.asarray(stderr, dtype=np.float64), log)


def ends(values: ArrayLike, reach: ArrayLike, log: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """The same of estimates from which an interval reaches so far, (p,), at the estimates' own scale."""
    value, reach = np.asarray(values, dtype=np.float64), np.asarray(reach, dtype=np.float64)
    on_log = np.asarray(log, dtype=bool) & (value > 0)
    # The exponent of a parameter that has gone to zero may overflow: its upper end then is infinite, and truly so.
    with np.errstate(over="ignore"):
        factor = np.exp(np.where(on_log, reach / np.where(on_log, value, 1.0), 0.0))
        return np.where(on_log, value / factor, value - reach), np.where(on_log, value * factor, value + reach)


def uncertainty(problem: Problem) -> Uncertainty:
    """Uncertainty of a fitted model's parameters at its present values; `problem` holds the rows of the fit."""
    problem = as_fitted(problem)
    model = problem.model
    vector = model.vector().detach()
    names = model.labels()
    with torch.no_grad():
        residual = problem.residuals(vector[None])[0] if problem.parted else problem.residual(vector)
    if problem.parted:
        # Its triangular factor has the same singular values and right vectors.
        jacobian = reduced(problem.pieces(vector[None]), residual[None]).factor[0]
    else:
        jacobian = problem.jacobians(vector[None])[0]
    # What is known beforehand is one more measurement of the parameters, in rows of its own.
    pull = Pull.from_problem(problem, vector)
    rows = jacobian
    if pull is not None:
        jacobian = torch.cat([rows, pull.root])
    physical = _flat(model, vector)
    to_physical = torch.func.jacfwd(lambda v: _flat(model, v))(vector)

    # Columns scaled to length one, so that units do not decide what counts as undetermined.
    length = jacobian.norm(dim=0)
    moved = length > 0
    scaled = jacobian / torch.where(moved, length, 1.0)
    _, singular, right = torch.linalg.svd(scaled, full_matrices=False)
    strong = singular > RANK_TOLERANCE * singular.max().clamp_min(1e-300)
    inverse = torch.where(strong, 1 / torch.where(strong, singular, 1.0), 0.0)
    half = (right.T * inverse) / torch.where(moved, length, 1.0)[:, None]
    bread = half @ half.T  # (JᵀJ)⁻¹
    determined = moved & ((right[~strong] ** 2).sum(0) < DETERMINED)

    rank = int(strong.sum())
    chi_square = float(residual.dot(residual) if problem.parted else residual.square().sum())
    count = problem.rows.readings.count
    textbook = bread * (chi_square / max(count - rank, 1))
    parts = problem.pieces(vector[None]) if problem.parted else [rows[None]]
    scores = state_scores((part[0] for part in parts), residual, problem.rows.state)
    states = len(scores)
    sandwich = bread @ (scores.T @ scores) @ bread * small_sample(states, rank)
    if pull is not None:
        own = bread @ (pull.root.T @ pull.root) @ bread
        textbook = textbook + own * (pull.spread**2 - chi_square / max(count - rank, 1))
        sandwich = sandwich + own * pull.spread**2
    independent, robust = (to_physical @ part @ to_physical.T for part in (textbook, sandwich))

    known = ((to_physical.abs() @ (~determined).double()) == 0).numpy()

    def errors(covariance: Tensor) -> np.ndarray:
        return np.where(known, covariance.diagonal().clamp_min(0).sqrt().numpy(), np.nan)

    freedom = max(states - rank, 1)
    stderr = errors(robust)
    log = [name in model.declared and model.declared[name].log for name in names]
    low, high = interval(physical.numpy(), stderr, log, freedom)
    return Uncertainty(
        names=names,
        values=physical.numpy(),
        stderr=stderr,
        stderr_independent=errors(independent),
        low=low,
        high=high,
        freedom=freedom,
        covariance=np.where(known[:, None] & known, robust.numpy(), np.nan),
        chi_square=chi_square,
        residuals=count,
        rows=int(problem.rows.readings.present.any(-1).count_nonzero()),
    )


def as_fitted(problem: Problem) -> Problem:
    """The problem that gave the parameters: the same, unless the model has learned more since."""
    part = least_squares_part(problem.model)
    return problem if part is problem.model else Problem(part, problem.rows, problem.scale)


def _flat(model: Model[Any], vector: Tensor) -> Tensor:
    values = model.physical(vector)
    return torch.cat([v.reshape(-1) for v in values.values()])


def state_scores(jacobian: Iterable[Tensor], residual: Tensor, state: np.ndarray) -> Tensor:
    """Each kinematic state's part of Jᵀr, (states, p): what its rows say together. jacobian: (2N, p), in pieces from
    above to below; residual: (2N,); state: (N,)."""
    cluster, at = torch.as_tensor(groups(state)), 0
    total = torch.zeros(0, 0)
    for piece in jacobian:
        rows = slice(at, at + len(piece) // 2)
        if not at:
            total = torch.zeros(int(cluster.max()) + 1, piece.shape[1], dtype=piece.dtype)
        scores = (piece * residual[2 * rows.start : 2 * rows.stop, None]).reshape(len(piece) // 2, 2, -1).sum(1)
        total.index_add_(0, cluster[rows], scores)
        at = rows.stop
    return total


def small_sample(states: int, rank: int) -> float:
    """G/(G−p): a fit's residuals are smaller than its errors. As for independent residuals (HC1; MacKinnon & White
    1985), but counting every kinematic state once, because all its rows may share one error."""
    return states / max(states - rank, 1)
