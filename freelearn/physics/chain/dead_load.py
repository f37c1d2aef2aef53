"""Where an actuator comes to rest under a dead load: the inverse of the chain, row by row."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known, indices_if_known
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.chain.row_derivatives import (
    CHORD_TOLERANCE,
    CHORDS,
    divide,
    enough,
    mended,
    recorded_with_rate,
    rows_jacobian,
)

MAX_ITERATIONS = 80
# Iterations after which only the rows that have not settled go on.
EARLY = 8
# A last step this small (in reference lengths and rad) leaves an error of about its square, which the differentiable
# step takes away besides.
TOLERANCE = 1e-11
# Largest change in one iteration: of the length, in reference lengths, and of the twist [rad].
LARGEST = (0.05, 1.0)
# A row whose excess has not fallen by a share of PROGRESS in so many iterations has no rest to be found: of a thousand
# that come to rest late, seven need more.
PROGRESS, PATIENCE = 0.01, 16
# Least stiffness that is followed, as a share of the largest: where the actuator gives way, it moves with the load.
SOFTEST = 1e-3
# Lengths, in reference lengths, and twist [rad] beyond which nothing is looked for.
RANGE = ((0.2, 4.0), (-25.0, 25.0))
# By these names States.near keeps q and the stiffness.
PLACE, STIFFNESS = "rest", "rest stiffness"

Values = dict[str, Tensor]
# The loads that the sensors would show at a state, and the values of some rows (RawVector.rows_of).
Loads = Callable[[States, Values], Prediction]
RowsOf = Callable[[Values, Tensor], Values]
# Where the actuator's end is that a camera sees at a place (N, 2), under the loads imposed.
End = Callable[[Tensor], Tensor]


def solve_dead_load(
    states: States, values: Values, loads: Loads, rows_of: RowsOf, end: End | None = None
) -> Prediction:
    """Elongation [m] and twist [rad] at which the chain gives the loads imposed, (N, 2), with exact first derivatives.

    Solves τ(q, P) = (F, M) for q = (l, φ) from the reference state, by Newton's method with bounded steps that follow
    the load where the stiffness −∂τ/∂q is not positive, so that it ends in stable states only. One more Newton step,
    with the stiffness cut from the derivative, has the derivative of the implicit function theorem (see mount).
    A row that does not settle, or not in a stable state, has no equilibrium. Where `near` holds a place (N, 2), two
    steps from there are all, or from the end of it, where a mount is between.
    """
    near, way = states.near, states.on_the_way()
    if near is not None and PLACE in near.held:
        seen = near.held[PLACE]
        found = _two_steps(way, seen if end is None else end(seen), values, loads)
        near.arrive(way.near)
        return found
    exact = torch.is_grad_enabled()
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        at = _solve(way.detach() if exact else way, fixed, loads, rows_of)

    def carried(q: Tensor) -> Prediction:
        return loads(_moved(way, q), values)

    if exact and at.rough:
        prediction, rate = recorded_with_rate(carried, at.q, states.doubled)
        at = _sharpened(at, states, -rate)
    else:
        prediction = carried(at.q)
    if near is not None:
        near.arrive(way.near)
        near.keep(PLACE, at.q, at.settled)
        near.keep(STIFFNESS, at.stiffness, at.settled)
    excess = prediction.loads - _hung(states)
    # The stiffness is −∂τ/∂q: an actuator that pushes harder than it is held lengthens.
    step = torch.where(at.settled[:, None], divide(excess, at.stiffness), 0.0)
    status = torch.where(at.settled, prediction.status, Status.NO_EQUILIBRIUM).to(torch.uint8)
    return Prediction(at.q + step - torch.stack([states.reference_length, 0 * states.twist], dim=-1), status)


def _two_steps(states: States, q: Tensor, values: Values, loads: Loads) -> Prediction:
    """Two steps of Newton's method from q (N, 2), both with the stiffness made positive where it is not.

    Where q is near rest, as a place that was measured is, that is rest to second order, and its derivative to first. It
    costs three evaluations of the loads, where the search for rest takes ten and more.
    """
    size = _size(states)
    hung = _hung(states)
    largest = size * torch.tensor(LARGEST, dtype=size.dtype, device=size.device)

    def carried(at: Tensor) -> Prediction:
        return loads(_moved(states, at), values)

    def stiffness(rate: Tensor) -> Tensor:
        scaled = size[:, :, None] * size[:, None, :]
        return _positive(-rate * scaled)[0] / scaled

    with torch.no_grad():
        at, rate = rows_jacobian(lambda place: carried(place).loads, q, states.doubled)
        slope = stiffness(rate)
        step = divide(at - hung, slope)
        q = q + torch.minimum(torch.maximum(step, -largest), largest)
    if torch.is_grad_enabled():
        prediction, rate = recorded_with_rate(carried, q, states.doubled)
        slope = stiffness(rate)
    else:
        prediction = carried(q)
    moved = q + divide(prediction.loads - hung, slope)
    return Prediction(moved - torch.stack([states.reference_length, 0 * states.twist], dim=-1), prediction.status)


class _Rest(NamedTuple):
    """q (N, 2) m, rad; stiffness −∂τ/∂q (N, 2, 2) there; settled (N,) bool. Cut from every derivative.

    rough: whether the stiffness is that of the way there."""

    q: Tensor
    stiffness: Tensor
    settled: Tensor
    rough: bool = False


def _solve(states: States, values: Values, loads: Loads, rows_of: RowsOf) -> _Rest:
    """From where the last search ended, if there was one."""
    q, near = torch.stack([states.length, states.twist], dim=-1), states.near
    if near is not None:
        q = near.start(PLACE, q)
        known = near.last(STIFFNESS, q[..., None].expand(-1, -1, 2))
        if known is not None:
            at = _chords(states, q, known, values, loads)
            left = indices_if_known(~at.settled)
            if left is not None:
                if len(left):
                    rest = _newton(states.some(left), q[left], rows_of(values, left), loads, MAX_ITERATIONS)
                    at = _joined(at, rest, left)
                return at._replace(rough=True)
            q = torch.where(at.settled[:, None], at.q, q)
    at = _newton(states, q, values, loads, EARLY)
    left = indices_if_known(~at.settled)
    if left is None:  # inside vmap
        return _newton(states, at.q, values, loads, MAX_ITERATIONS - EARLY)
    if len(left):
        rest = _newton(states.some(left), at.q[left], rows_of(values, left), loads, MAX_ITERATIONS - EARLY)
        at = _joined(at, rest, left)
    return at


def _sharpened(at: _Rest, states: States, stiffness: Tensor) -> _Rest:
    """With the stiffness at q itself."""
    size = _size(states)
    stable = _positive(stiffness * size[:, :, None] * size[:, None, :])[1]
    return at._replace(stiffness=stiffness, settled=at.settled & stable)


def _joined(at: _Rest, rest: _Rest, left: Tensor) -> _Rest:
    """The one, with the other's rows in the places that are left."""
    return _Rest(
        at.q.index_copy(0, left, rest.q),
        at.stiffness.index_copy(0, left, rest.stiffness),
        at.settled.index_copy(0, left, rest.settled),
    )


def _chords(states: States, q: Tensor, stiffness: Tensor, values: Values, loads: Loads) -> _Rest:
    """A few of Newton's steps from q (N, 2) with the stiffness (N, 2, 2) of a place nearby: no derivatives taken.

    Each pair of loads on the way mends it along the step that led there (Broyden 1965). Rows whose stiffness is not
    known, or not stable, or that do not settle, are left to Newton's method.
    """
    size = _size(states)
    hung = _hung(states)
    excess = loads(_moved(states, q), values).loads - hung
    for turn in range(CHORDS):
        step = divide(excess, stiffness)
        settled = (step.abs() <= CHORD_TOLERANCE * size).all(-1)
        if enough(settled, turn):
            break
        q, before = q + step, excess
        excess = loads(_moved(states, q), values).loads - hung
        stiffness = mended(stiffness, before - excess, step, size)
    stable = _positive(stiffness * size[:, :, None] * size[:, None, :])[1]
    return _Rest(q, stiffness, settled & stable)


def _newton(states: States, q: Tensor, values: Values, loads: Loads, iterations: int) -> _Rest:
    size = _size(states)
    largest = torch.tensor(LARGEST, dtype=size.dtype, device=size.device).expand_as(size)
    bounds = torch.tensor(RANGE, dtype=size.dtype, device=size.device)
    hung, reach, before = _hung(states), largest, None
    least, idle = torch.full_like(q[:, 0], torch.inf), torch.zeros_like(q[:, 0])
    for _ in range(iterations):
        carried, rate = rows_jacobian(lambda at: loads(_moved(states, at), values).loads, q, states.doubled)
        # In units of the reference length and of rad: both loads are then moments, and their rates comparable.
        excess, stiffness = (carried - hung) * size, -rate * size[:, :, None] * size[:, None, :]
        followed, stable = _positive(stiffness)
        step = divide(excess, followed)
        settled = (step.abs() <= TOLERANCE).all(-1) & stable
        if all_if_known(settled):
            break
        far = excess.norm(dim=-1)
        if before is not None:
            # Steps that made it worse were too long.
            reach = torch.where((far > before)[:, None], reach / 2, torch.minimum(1.5 * reach, largest))
        before = far
        nearer = far < (1 - PROGRESS) * least
        least, idle = torch.where(nearer, far, least), torch.where(nearer, 0.0, idle + 1)
        scaled = torch.minimum(torch.maximum(step, -reach), reach)
        moved = size * torch.minimum(torch.maximum(q / size + scaled, bounds[:, 0]), bounds[:, 1])
        held = (moved == q).all(-1) | ~far.isfinite() | (idle >= PATIENCE)
        q = torch.where(settled[:, None], q, moved)
        if all_if_known(settled | held):
            # What the bounds hold would go on beyond; and of what comes no nearer nothing is to be hoped.
            break
    return _Rest(q, -rate, settled)


def _size(states: States) -> Tensor:
    """Units of length and twist, (N, 2): the reference length and 1 rad."""
    return torch.stack([states.reference_length, torch.ones_like(states.length)], dim=-1)


def _hung(states: States) -> Tensor:
    """The loads imposed, (N, 2) SI."""
    return torch.stack([states.force, states.moment], dim=-1)


def _positive(stiffness: Tensor) -> tuple[Tensor, Tensor]:
    """Stiffness (N, 2, 2) made positive where it is not, and whether it was, (N,) bool."""
    even = (stiffness + stiffness.mT) / 2
    mean, half = (even[:, 0, 0] + even[:, 1, 1]) / 2, (even[:, 0, 0] - even[:, 1, 1]) / 2
    spread = torch.hypot(half, even[:, 0, 1])
    lowest, most = mean - spread, (mean.abs() + spread).clamp_min(1e-12)
    lift = (SOFTEST * most - lowest).clamp_min(0.0)
    identity = torch.eye(2, dtype=stiffness.dtype, device=stiffness.device)
    stable = (stiffness[:, 0, 0] * stiffness[:, 1, 1] > stiffness[:, 0, 1] * stiffness[:, 1, 0]) & (mean > 0)
    # What is stable, if only just, is followed as it is.
    return torch.where(stable[:, None, None], stiffness, even + lift[:, None, None] * identity), stable


def _moved(states: States, q: Tensor) -> States:
    return states.replace(length=q[:, 0], twist=q[:, 1])
