"""What several models say together: the mean of their answers, and how far they lie apart (Hoeting et al. 1999)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from freelearn.physics.chain.prediction import Status
from freelearn.queries.answers import STATUS, Answers
from freelearn.queries.fitted_model import Answer
from freelearn.queries.inverse.miss import NORMAL

Array = np.ndarray
OK = Status.OK.name.lower()


def predictive_shares(probabilities: Sequence[float], errors: Sequence[float | None], states: int) -> list[float]:
    """Shares of models, from their probabilities and their errors on so many states that were left out.

    What they say of these counts as it would with noise of a size that nobody knows: by a likelihood that goes as
    error⁻ⁿ (Geisser & Eddy 1979). Where no error is known the probabilities count alone."""
    known = np.array([error if error is not None and error > 0 else np.inf for error in errors])
    if not np.isfinite(known).any():
        return list(probabilities)
    return [float(p * (known.min() / error) ** states) for p, error in zip(probabilities, known, strict=True)]


def weighted_mean(values: Array, shares: Sequence[float]) -> tuple[Array, Array, Array]:
    """Mean and standard deviation of the values (k, …) that there are, NaN elsewhere, with shares (k,), and where these
    are half of all."""
    there = np.isfinite(values)
    weight = np.where(there, np.reshape(shares, (-1, *[1] * (values.ndim - 1))), 0.0)
    known, values = weight.sum(0), np.where(there, values, 0.0)
    told = known >= 0.5 * sum(shares)
    weight = weight / np.where(known > 0, known, 1.0)
    mean = (weight * values).sum(0)
    return mean, np.sqrt((weight * (values - mean) ** 2).sum(0)), told


def averaged_prediction(last: Answer, others: Sequence[Answer], shares: Sequence[float]) -> Answer:
    """The mean of what models predict of the same rows, each with its share; where the search's last model or
    half of them have no answer, its own. Standard errors and bands are its own too, wider by how far they lie apart."""
    values = np.stack([np.where(_usable(other.status)[:, None], other.loads, np.nan) for other in others])
    mean, apart, told = weighted_mean(values, shares)
    told &= _usable(last.status)[:, None]
    return replace(
        last,
        loads=np.where(told, mean, last.loads),
        stderr=np.where(told, np.hypot(last.stderr, apart), last.stderr),
        half=np.where(told, np.hypot(last.half, NORMAL * apart), last.half),
    )


def averaged_answers(last: Answers, others: Sequence[Answers], shares: Sequence[float]) -> Answers:
    """The same of a table with blanks: in every column that was filled, with its band."""
    filled = last.filled.copy()
    for name in last.asked:
        values = np.stack([np.where(_usable(each.filled[STATUS]), each.filled[name], np.nan) for each in others])
        mean, apart, told = weighted_mean(values, shares)
        told &= _usable(filled[STATUS])
        value, low, high = (filled[column].to_numpy(np.float64) for column in (name, f"{name}_low", f"{name}_high"))
        middle = np.where(told, mean, value)
        half = np.where(told, np.hypot((high - low) / 2, NORMAL * apart), (high - low) / 2)
        filled[name], filled[f"{name}_low"], filled[f"{name}_high"] = middle, middle - half, middle + half
    return replace(last, filled=filled)


def _usable(status: Iterable[str]) -> Array:
    """Which rows have an answer, (N,) bool."""
    return np.array([each == OK for each in status], dtype=bool)
