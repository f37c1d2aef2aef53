"""Where a mount that gives way and the actuator agree: effects whose imposed state depends on the loads."""

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
    determinant,
    divide,
    enough,
    mended,
    recorded_with_rate,
    rows_jacobian,
)

MAX_ITERATIONS = 15
# Iterations after which only the rows that have not settled go on, and of these such whose steps have become smaller
# than this share of what they were as many iterations before: the others go nowhere.
EARLY, SLOW = 5, 0.5
# A step so small leads to the place for which the search is bound: chords find it at a third of the price.
NEARBY = 3e-3
# Newton steps this small (in reference lengths and rad) leave an error of about their square, which the
# differentiable step takes away besides.
TOLERANCE = 1e-11
# Largest change in one iteration: of the length, in reference lengths, and of the twist [rad].
LARGEST = (0.05, 0.3)
# Iterations of the way back through a mount.
BACK = 8
# By these names States.near keeps q and A.
PLACE, STIFFNESS = "mount", "mount stiffness"

Values = dict[str, Tensor]
# The state imposed by a mount that carries these loads, and the loads of an actuator at a state.
Impose = Callable[[States, Tensor, Values], States]
Loads = Callable[[States, Values], Prediction]
# The values of some rows (RawVector.rows_of).
RowsOf = Callable[[Values, Tensor], Values]


class Settled(NamedTuple):
    """The state (l, φ) at which mount and actuator agree, and the loads there, both differentiable."""

    states: States
    prediction: Prediction


def settle(states: States, values: Values, impose: Impose, loads: Loads, rows_of: RowsOf) -> Settled:
    """Solves q = impose(τ(q)) for q = (l, φ), row by row, with exact first derivatives of any kind.

    With the mismatch g(q) = q − impose(τ(q)), A = ∂τ/∂q and J = ∂g/∂q (2 × 2 a row), Newton's method finds q without
    recording derivatives. One more step, q − J⁻¹ g with q and J cut from the derivative, has the derivative of the
    implicit function theorem, and τ + A (q_new − q) that of the loads (see equilibrium). A row that does not
    settle, or only where the mount has snapped through (det J ≤ 0), counts as one without equilibrium.
    """
    exact = torch.is_grad_enabled()
    way = states.on_the_way()
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        at = _solve(way.detach() if exact else way, fixed, impose, loads, rows_of)

    def carried(q: Tensor) -> Prediction:
        return loads(way.replace(length=q[:, 0], twist=q[:, 1]), values)

    if exact and at.rough:
        prediction, stiffness = recorded_with_rate(carried, at.q, states.doubled)
        at = _sharpened(at, states, prediction.loads, stiffness, fixed, impose)
    else:
        prediction = carried(at.q)
    if states.near:
        states.near.arrive(way.near)
        states.near.keep(PLACE, at.q, at.settled)
        states.near.keep(STIFFNESS, at.stiffness, at.settled)
    imposed = _place(impose(states, prediction.loads, values))
    step = torch.where(at.settled[:, None], -divide(at.q - imposed, at.jacobian), 0.0)
    moved = (at.stiffness * step[:, None, :]).sum(-1)
    status = torch.where(at.settled, prediction.status, Status.NO_EQUILIBRIUM).to(torch.uint8)
    agreed = states.replace(length=at.q[:, 0] + step[:, 0], twist=at.q[:, 1] + step[:, 1])
    return Settled(agreed, Prediction(prediction.loads + moved, status))


def before_mount(states: States, place: Tensor, loads: Tensor, values: Values, impose: Impose) -> Prediction:
    """Where the table says (N, 2) that actuators end at a place (N, 2), of mounts that carry these loads (N, 2): what
    impose makes the other way around, by Newton's method, with exact first derivatives.

    A row whose place the mount reaches from nowhere, or only snapped through, counts as one without equilibrium."""

    def imposed(q: Tensor, loads: Tensor, values: Values) -> Tensor:
        return _place(impose(states.replace(length=q[:, 0], twist=q[:, 1]), loads, values))

    size = _size(states)
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        q, carried = place.detach(), loads.detach()
        # Of a spring, whose way is that of its load wherever it stands, one is all.
        for _ in range(BACK):
            there, rate = rows_jacobian(lambda at: imposed(at, carried, fixed), q, states.doubled)
            step = divide(place.detach() - there, rate)
            q = q + step
            settled = (step.abs() <= TOLERANCE * size).all(-1) & (determinant(rate) > 0)
            if all_if_known(settled):
                break
    q = q + divide(place - imposed(q, loads, values), rate)
    return Prediction(q, torch.where(settled, Status.OK, Status.NO_EQUILIBRIUM).to(torch.uint8))


class _Solution(NamedTuple):
    """q (N, 2) m, rad; J (N, 2, 2) and A = ∂τ/∂q (N, 2, 2) there; settled (N,) bool. Cut from every derivative.

    last: the size of the last step, (N,), in what counts as one. rough: whether J and A are those of the way there."""

    q: Tensor
    jacobian: Tensor
    stiffness: Tensor
    settled: Tensor
    last: Tensor
    rough: bool = False


def _solve(states: States, values: Values, impose: Impose, loads: Loads, rows_of: RowsOf) -> _Solution:
    """From where the last search ended, if there was one."""
    q, near = _place(states), states.near
    known = None
    if near is not None:
        q = near.start(PLACE, q)
        known = near.last(STIFFNESS, q[..., None].expand(-1, -1, 2))
    if all_if_known(q.isnan()) is None:  # inside vmap
        at = _newton(states, q, values, impose, loads, MAX_ITERATIONS)
        return at._replace(settled=at.settled & (determinant(at.jacobian) > 0))
    if known is None:
        begun = _newton(states, q, values, impose, loads, EARLY, NEARBY)
        q, known = begun.q, begun.stiffness
    at = _chords(states, q, known, values, impose, loads)
    # Others than have settled begin anew.
    q = torch.where(at.settled[:, None], at.q, q)
    return _gone_on(at._replace(q=q, rough=True), states, values, impose, loads, rows_of)


def _gone_on(at: _Solution, states: States, values: Values, impose: Impose, loads: Loads, rows_of: RowsOf) -> _Solution:
    """The rows that have not settled go on by Newton's method: most settle in a few steps, so only these cost more."""
    left, done = indices_if_known(~at.settled), 0
    while left is not None and len(left) and done < MAX_ITERATIONS:
        before = at.last[left]
        rest = _newton(states.some(left), at.q[left], rows_of(values, left), impose, loads, EARLY)
        at, done = _joined(at, rest, left), done + EARLY
        left = left[~rest.settled & (rest.last < SLOW * before)]
    settled = at.settled & (determinant(at.jacobian) > 0)
    return at._replace(q=at.q.detach(), jacobian=at.jacobian.detach(), stiffness=at.stiffness.detach(), settled=settled)


def _sharpened(
    at: _Solution, states: States, carried: Tensor, stiffness: Tensor, values: Values, impose: Impose
) -> _Solution:
    """With A and J at q itself, where the actuator carries the loads (N, 2)."""
    held = states.detach()
    _, yielding = rows_jacobian(lambda given: _place(impose(held, given, values)), carried.detach(), held.doubled)
    jacobian = torch.eye(2, dtype=at.q.dtype, device=at.q.device) - yielding @ stiffness
    return at._replace(jacobian=jacobian, stiffness=stiffness, settled=at.settled & (determinant(jacobian) > 0))


def _joined(at: _Solution, rest: _Solution, left: Tensor) -> _Solution:
    """The one, with the other's rows in the places that are left."""
    return _Solution(
        at.q.index_copy(0, left, rest.q),
        at.jacobian.index_copy(0, left, rest.jacobian),
        at.stiffness.index_copy(0, left, rest.stiffness),
        at.settled.index_copy(0, left, rest.settled),
        at.last.index_copy(0, left, rest.last),
        at.rough,
    )


def _chords(states: States, q: Tensor, stiffness: Tensor, values: Values, impose: Impose, loads: Loads) -> _Solution:
    """A few of Newton's steps from q (N, 2) with the stiffness A (N, 2, 2) of a place nearby: no derivatives taken.

    Each pair of loads on the way mends A along the step that led there (Broyden 1965). Rows whose A is not known, or
    that do not settle, are left to Newton's method.
    """
    size = _size(states)
    largest = _largest(size)
    carried = loads(states.replace(length=q[:, 0], twist=q[:, 1]), values).loads
    imposed, yielding = rows_jacobian(lambda given: _place(impose(states, given, values)), carried, states.doubled)
    for turn in range(CHORDS):
        jacobian = _identity(size) - yielding @ stiffness
        step = -divide(q - imposed, jacobian)
        settled = (step.abs() <= CHORD_TOLERANCE * size).all(-1)
        if enough(settled, turn):
            break
        step = torch.minimum(torch.maximum(step, -largest), largest)
        q, before = q + step, carried
        carried = loads(states.replace(length=q[:, 0], twist=q[:, 1]), values).loads
        stiffness = mended(stiffness, carried - before, step, size)
        imposed = _place(impose(states, carried, values))
    # Newton's method has taken none of its steps yet.
    return _Solution(q, jacobian, stiffness, settled, torch.full_like(q[:, 0], torch.inf))


def _size(states: States) -> Tensor:
    """What counts as one of (l, φ): the reference length and 1 rad, (N, 2)."""
    return torch.stack([states.reference_length, torch.ones_like(states.length)], dim=-1)


def _largest(size: Tensor) -> Tensor:
    return size * torch.tensor(LARGEST, dtype=size.dtype, device=size.device)


def _identity(size: Tensor) -> Tensor:
    return torch.eye(2, dtype=size.dtype, device=size.device)


def _newton(
    states: States,
    q: Tensor,
    values: Values,
    impose: Impose,
    loads: Loads,
    iterations: int,
    nearby: float = 0.0,
) -> _Solution:
    """At most so many iterations of Newton's method from q (N, 2). nearby: a step so small ends it before it settles,
    in what counts as one."""
    size = _size(states)
    largest = _largest(size)
    identity = _identity(size)
    for _ in range(iterations):
        carried, stiffness = rows_jacobian(
            lambda at: loads(states.replace(length=at[:, 0], twist=at[:, 1]), values).loads, q, states.doubled
        )
        imposed, yielding = rows_jacobian(lambda given: _place(impose(states, given, values)), carried, states.doubled)
        jacobian = identity - yielding @ stiffness
        step = -divide(q - imposed, jacobian)
        settled = (step.abs() <= TOLERANCE * size).all(-1)
        if all_if_known(settled | step.isnan().any(-1)):
            break
        # A row that has settled stays, so that J remains the one at its state.
        step = torch.where(settled[:, None], 0.0, torch.minimum(torch.maximum(step, -largest), largest))
        q = q + step
        if nearby and all_if_known((step.abs() <= nearby * size).all(-1)):
            break
    return _Solution(q, jacobian, stiffness, settled, (step / size).abs().amax(-1))


def _place(states: States) -> Tensor:
    """(l, φ) as (N, 2)."""
    return torch.stack([states.length, states.twist], dim=-1)
