"""What the order of measuring cannot tell: where states were measured sorted, time and an input go together."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.bed_accuracy import sensors
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.prepare import Prepared, without
from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.shapes import Block, both_loads, dense, imposed, rows_of_samples, scaled
from freelearn.discovery.search.next_states import NextState, next_state
from freelearn.discovery.thresholds import COINCIDE, SORTED

DRIFT = "sensor_drift"
# Knots of a function of one input: what may stand in the place of a drift.
KNOTS = 8


def unknown(name: str) -> str:
    """What something that depends on an input, but is in no library, is called in a class."""
    return f"unknown function of {name}"


def inputs(states: States) -> Mapping[str, Tensor]:
    """What a bed may go through in order, each (N,)."""
    return {quantity.name: imposed(states)[quantity.name] for quantity in states.bed.state}


def confounded(prepared: Prepared, final: Step) -> list[str]:
    """Inputs of which an unknown function would explain as much as the drift that the final model has."""
    if DRIFT not in prepared.question.added(final.effects):
        return []
    states = prepared.rows.states
    sorted_by = in_order_of(states)
    reduced = without(prepared, final, DRIFT) if sorted_by else None
    if reduced is None:
        return []
    out = []
    for name in sorted_by:
        rival = _with_function(reduced, _of_each_sample(states, inputs(states)[name]))
        if rival.chi2 <= final.fit.chi2 + COINCIDE:
            out.append(name)
    return out


def telling_repeat(final: Step, rows: Rows, name: str, accuracy: Accuracy) -> NextState:
    """The state that was measured first on the sample with the longest run: measured once more after the last one, it
    shows whether time or the input decides."""
    states = rows.states
    last = int(states.clock.argmax())
    own = torch.nonzero(states.sample == states.sample[last])[:, 0]
    first = int(own[states.clock[own].argmin()])
    values = final.fit.values()
    noise = sensors(accuracy, states.bed)
    rates = torch.tensor([values[f"{DRIFT}.force_rate"], values[f"{DRIFT}.moment_rate"]], dtype=torch.float64)
    drifted = rates * (states.clock[last] - states.clock[first])
    return next_state(states, first, [DRIFT, unknown(name)], float((drifted / noise).square().sum().sqrt()))


def in_order_of(states: States) -> list[str]:
    """Inputs in whose order the states were measured."""
    return [name for name, x in inputs(states).items() if sortedness(states, x) > SORTED]


def sortedness(states: States, x: Tensor) -> float:
    """Share of the clock's variance within samples that smooth functions of x (N,) explain: one where x was gone
    through in order, about zero where the order was at random."""
    explained = total = 0.0
    for rows in rows_of_samples(states):
        clock = states.clock[rows] - states.clock[rows].mean()
        basis = orthonormal(hinges(x[rows]))
        explained += float((basis.T @ clock).square().sum())
        total += float(clock.square().sum())
    return explained / total if total > 0 else 0.0


def hinges(x: Tensor) -> Tensor:
    """Continuous functions of x (N,), straight between knots at its quantiles: (N, KNOTS + 2)."""
    x = scaled(x)
    knots = torch.quantile(x, torch.linspace(0, 1, KNOTS + 2, dtype=x.dtype)[1:-1])
    return torch.cat([torch.ones_like(x)[:, None], x[:, None], (x[:, None] - knots).clamp_min(0)], dim=1)


def _of_each_sample(states: States, x: Tensor) -> Tensor:
    """The hinges of x (N,) in each sample alone, (N, k)."""
    return dense([Block(rows, hinges(x[rows])) for rows in rows_of_samples(states)], len(x))


def _with_function(reduced: Step, shapes: Tensor) -> WhiteFit:
    """The reduced model with shapes (N, k) added to either load, linear in their coefficients."""
    columns = both_loads(shapes, shapes)
    fit = reduced.fit
    white = reduced.whiten(columns)
    jacobian = torch.cat([fit.jacobian, white], dim=2)
    flat = jacobian.flatten(0, 1)
    scale = flat.square().sum(0).sqrt().clamp_min(1e-300)
    move = torch.linalg.pinv(flat / scale, rtol=1e-8) @ fit.residual.reshape(-1) / scale
    raw = torch.cat([fit.raw_jacobian, columns], dim=2)
    return WhiteFit(
        fit.model,
        fit.vector,
        fit.residual - jacobian @ move,
        jacobian,
        fit.raw_residual - raw @ move,
        raw,
        fit.shown - columns @ move[fit.jacobian.shape[2] :],
        True,
        "",
    )
