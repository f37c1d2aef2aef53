"""What follows a fit: for kinds of models that learn more from the training rows once their parameters are fitted."""

from __future__ import annotations

from copy import deepcopy
from functools import singledispatch
from typing import Any

from freelearn.data.rows import Rows
from freelearn.fitting.learned_residual import learn_remainder
from freelearn.physics.chain.model import Model
from freelearn.physics.models.hybrid import Hybrid


@singledispatch
def finish(model: Model[Any], rows: Rows) -> None:
    """Learns from the training rows what a fit of parameters cannot. Nothing by default."""


@finish.register
def _hybrid(model: Hybrid, rows: Rows) -> None:
    learn_remainder(model, rows)


@singledispatch
def least_squares_part(model: Model[Any]) -> Model[Any]:
    """The model as its parameters were fitted, before it learned more: what their standard errors are of."""
    return model


@least_squares_part.register
def _plain(model: Hybrid) -> Model[Any]:
    plain = deepcopy(model)
    plain.clear()
    return plain
