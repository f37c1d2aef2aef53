"""What several models say together: the mean of their answers, and how far they lie apart (Hoeting et al. 1999)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freelearn.physics.chain.prediction import Status
from freelearn.queries.answers import STATUS, Answers
from freelearn.queries.fitted_model import Answer

Array = np.ndarray
OK = Status.OK.name.lower()
# Half of a band that holds 95 %, in standard deviations.
HALF = 1.96


def predictive_shares(probabilities: Sequence[float], errors: Sequence[float | None], states: int) -> list[float]:
    """Shares of models, from their probabilities and their errors on so many states that were left out.

    What they say of these counts as it would with noise of a size that nobody knows: by a likelihood that goes as
    error⁻ⁿ (Geisser & Eddy 1979). Where no error is known the probabilities count alone."""
    known = np.array([error if error is not None and error > 0 else np.inf for error in errors])
    if not np.isfinite(known).any():
        return list(probabilities)
    return [float(p * (known.min() / error) ** states) for p, error in zip(probabilities, known, strict=True)]


def weighted_mean(values: Array, there: Array, shares: Sequence[float]) -> tuple[Array, Array, Array]:
    """Mean and standard deviation of the values (k, …) that are there, with shares (k,), and where these are half of
    all."""
    there = there & np.isfinite(values)
    weight = np.where(there, np.reshape(shares, (-1, *[1] * (values.ndim - 1))), 0.0)
    known, values = weight.sum(0), np.where(there, values, 0.0)
    told = known >= 0.5 * sum(shares)
    weight = weight / np.where(known > 0, known, 1.0)
    mean = (weight * values).sum(0)
    return mean, np.sqrt((weight * (values - mean) ** 2).sum(0)), told


def averaged_prediction(last: Answer, others: Sequence[Answer], shares: Sequence[float]) -> Answer:
    """The mean of what models predict of the same rows, each with its share; where the search's last model or
    half of them have no answer, its own. Standard errors and bands are its own too, wider by how far they lie apart."""
    there = np.array([[status == OK for status in other.status] for other in others])
    mean, apart, told = weighted_mean(np.stack([other.loads for other in others]), there[..., None], shares)
    told &= np.array([status == OK for status in last.status])[:, None]
    return replace(
        last,
        loads=np.where(told, mean, last.loads),
        stderr=np.where(told, np.hypot(last.stderr, apart), last.stderr),
        half=np.where(told, np.hypot(last.half, HALF * apart), last.half),
    )


def averaged_answers(last: Answers, others: Sequence[Answers], shares: Sequence[float]) -> Answers:
    """The same of a table with blanks: in every column that was filled, with its band."""
    there = np.stack([(other.filled[STATUS] == OK).to_numpy() for other in others])
    usable, filled = (last.filled[STATUS] == OK).to_numpy(), last.filled.copy()
    for name in last.asked:
        values = np.stack([other.filled[name].to_numpy(np.float64) for other in others])
        mean, apart, told = weighted_mean(values, there, shares)
        told &= usable
        value, low, high = (filled[column].to_numpy(np.float64) for column in (name, f"{name}_low", f"{name}_high"))
        middle = np.where(told, mean, value)
        half = np.where(told, np.hypot((high - low) / 2, HALF * apart), (high - low) / 2)
        filled[name], filled[f"{name}_low"], filled[f"{name}_high"] = middle, middle - half, middle + half
    return replace(last, filled=filled)
