"""How an end block tilts under the unequal pushes of the actuators that it holds: each moves by more than the block."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known, indices_if_known
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.chain.row_derivatives import recorded_with_rate, rows_jacobian

MAX_ITERATIONS = 20
# Iterations after which only the rows that have not settled go on, and of these such whose steps have become smaller
# than this share of what they were as many iterations before: the others go nowhere.
EARLY, SLOW = 6, 0.5
# Steps this small, in reference lengths, leave an error of about their square, which the last step takes away.
TOLERANCE = 1e-11
# Largest change in one iteration, in reference lengths.
LARGEST = 0.05
# Steps from which a slope is taken, in reference lengths: of shorter ones rounding would be a part.
TOLD = 1e-7
# By these names States.near keeps the members' travel and their stiffness.
TRAVEL, STIFFNESS = "tilt", "tilt stiffness"

Values = dict[str, Tensor]
# The loads that the members hand on at a state, and the values of some rows (RawVector.rows_of).
Carried = Callable[[States, Values], Prediction]
RowsOf = Callable[[Values, Tensor], Values]


def tilt(
    states: States, count: int, compliance: Tensor, values: Values, carried: Carried, rows_of: RowsOf
) -> Prediction:
    """Loads (k N, 2) of k members on a block that tilts, all rows of the first member, then of the next.

    states, values: of the members at the block's own length, (k N,). compliance: c ≥ 0 of the block, () or (N,) m/N.

    The members stand at one distance R from the axis, at equal angles β in their order. Their pushes f turn the block
    about the two axes across by C_θ R Σ f (cos β, sin β), and so lift member i by e_i = c Σ_j cos(β_i − β_j) f_j(e_j)
    with c = C_θ R². Newton's method finds e; one more step, with the slopes cut from the derivative, has the derivative
    of the implicit function theorem (see mount). A tilt does work on nothing but the members and the spring that
    resists it, so that ∂F/∂φ = ∂M/∂l is kept. A row that does not settle, or only where the block has snapped over,
    counts as one without equilibrium. c = 0 changes nothing to the last bit.
    """
    exact = torch.is_grad_enabled()
    way = states.on_the_way()
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        still = way.detach() if exact else way
        soft = compliance.detach().expand(len(states) // count)
        at = _solve(still, count, soft, fixed, carried, rows_of)

    def lifted(travel: Tensor) -> Prediction:
        return carried(way.replace(length=states.length + travel[:, 0]), values)

    if exact and states.near is not None:
        prediction, rate = recorded_with_rate(lifted, _flat(at.travel), states.doubled)
        at = at._replace(slope=rate[..., 0])
    else:
        prediction = lifted(_flat(at.travel))
    matrix = _matrix(_each(at.slope[:, 0], count), soft)
    settled = at.settled & (torch.linalg.det(matrix) > 0)
    if states.near:
        states.near.arrive(way.near)
        states.near.keep(TRAVEL, at.travel, settled)
        states.near.keep(STIFFNESS, _each(at.slope[:, 0], count), settled)
    push = _each(prediction.loads[:, 0], count)
    missed = compliance.expand(len(settled))[:, None] * (push @ _shared(push)) - at.travel
    step = torch.where(settled[:, None], _solved(matrix, missed), 0.0)
    status = torch.where(settled.repeat(count), prediction.status, Status.NO_EQUILIBRIUM).to(torch.uint8)
    return Prediction(prediction.loads + at.slope * _flat(step), status)


class _Lifted(NamedTuple):
    """travel e (N, k) m; slope ∂(f, m)/∂l of each member there, (k N, 2); settled (N,) bool; last: the size of the last
    step, (N,), in reference lengths. Cut from every derivative."""

    travel: Tensor
    slope: Tensor
    settled: Tensor
    last: Tensor


def _solve(
    states: States, count: int, compliance: Tensor, values: Values, carried: Carried, rows_of: RowsOf
) -> _Lifted:
    """From where the last search ended, if there was one: then with slopes seen on the way, and else with their own.

    Most rows settle in a few steps. The others, where a thread just goes slack, say, go on with slopes of their own: of
    two places on either side of a kink no slope is told."""
    near, size = states.near, _each(states.reference_length, count)
    if near is not None and near.held:
        return _scouted(states, count, compliance, values, carried)
    none = torch.zeros_like(size)
    if near is None:
        return _newton(states, count, compliance, values, carried, none, MAX_ITERATIONS)
    begun, known = near.start(TRAVEL, none), near.start(STIFFNESS, none)
    at = _secants(states, count, compliance, values, carried, begun, known)
    left, done = indices_if_known(~at.settled), EARLY
    if left is None:  # inside vmap
        return _newton(states, count, compliance, values, carried, at.travel, MAX_ITERATIONS)
    while len(left) and done < MAX_ITERATIONS:
        before = at.last[left]
        each = (left + len(size) * torch.arange(count, device=left.device)[:, None]).reshape(-1)
        some, own = states.some(each), rows_of(values, each)
        rest = _newton(some, count, compliance[left], own, carried, at.travel[left], EARLY)
        at, done = _joined(at, rest, left, each), done + EARLY
        left = left[~rest.settled & (rest.last < SLOW * before)]
    return at


def _joined(at: _Lifted, rest: _Lifted, left: Tensor, each: Tensor) -> _Lifted:
    """The one, with the other's rows in the places that are left, by the block's rows and its members'."""
    return _Lifted(
        at.travel.index_copy(0, left, rest.travel),
        at.slope.index_copy(0, each, rest.slope),
        at.settled.index_copy(0, left, rest.settled),
        at.last.index_copy(0, left, rest.last),
    )


def _secants(
    states: States, count: int, compliance: Tensor, values: Values, carried: Carried, travel: Tensor, known: Tensor
) -> _Lifted:
    """A few steps from a travel (N, k), with slopes (N, k) known there, and then seen on the way."""
    size, before = _each(states.reference_length, count), None
    for _ in range(EARLY):
        loads = carried(states.replace(length=states.length + _flat(travel)[:, 0]), values).loads
        push = _each(loads[:, 0], count)
        if before is not None:
            moved = travel - before[0]
            told = moved.abs() > TOLD * size
            known = torch.where(told, (push - before[1]) / torch.where(told, moved, 1.0), known)
        before = travel, push
        step, settled = _step(travel, push, known, compliance, size)
        if all_if_known(settled):
            break
        # A row that has settled stays, so that its slopes remain those at its state.
        travel = torch.where(settled[:, None], travel, travel + step)
    # Newton's method has taken none of its steps yet.
    slope = torch.stack([known.T.reshape(-1), torch.zeros_like(states.length)], dim=-1)
    return _Lifted(travel, slope, settled, torch.full_like(travel[:, 0], torch.inf))


def _newton(
    states: States, count: int, compliance: Tensor, values: Values, carried: Carried, travel: Tensor, iterations: int
) -> _Lifted:
    """At most so many iterations of Newton's method from a travel (N, k)."""
    size = _each(states.reference_length, count)

    def lifted(at: Tensor) -> Tensor:
        return carried(states.replace(length=states.length + at[:, 0]), values).loads

    for _ in range(iterations):
        loads, rate = rows_jacobian(lifted, _flat(travel))
        slope = rate[..., 0]
        step, settled = _step(travel, _each(loads[:, 0], count), _each(slope[:, 0], count), compliance, size)
        if all_if_known(settled):
            break
        travel = torch.where(settled[:, None], travel, travel + step)
    return _Lifted(travel, slope, settled, (step / size).abs().amax(-1))


def _step(travel: Tensor, push: Tensor, slope: Tensor, compliance: Tensor, size: Tensor) -> tuple[Tensor, Tensor]:
    """Newton's step (N, k) from a travel under pushes with these slopes, all (N, k), and whether it is none, (N,)."""
    missed = compliance[:, None] * (push @ _shared(push)) - travel
    step = _solved(_matrix(slope, compliance), missed)
    settled = (step.abs() <= TOLERANCE * size).all(-1)
    return torch.minimum(torch.maximum(step, -LARGEST * size), LARGEST * size), settled


def _scouted(states: States, count: int, compliance: Tensor, values: Values, carried: Carried) -> _Lifted:
    """One step of Newton's method from no tilt, and the slopes there: with the step that follows good to third order in
    the tilt, where the place itself is known to second order only (see hang)."""
    level = torch.zeros_like(states.length)[:, None]
    loads, rate = rows_jacobian(
        lambda at: carried(states.replace(length=states.length + at[:, 0]), values).loads, level, states.doubled
    )
    push = compliance[:, None] * (_each(loads[:, 0], count) @ _shared(_each(states.length, count)))
    travel = _solved(_matrix(_each(rate[:, 0, 0], count), compliance), push)
    size = _each(states.reference_length, count)
    settled = (travel.abs() <= LARGEST * size).all(-1)
    last = (travel / size).abs().amax(-1)
    return _Lifted(torch.where(settled[:, None], travel, 0.0), rate[..., 0], settled, last)


def _shared(each: Tensor) -> Tensor:
    """cos(β_i − β_j), (k, k), for what is (N, k): how far i is lifted as j is."""
    count = each.shape[-1]
    angle = 2 * math.pi / count * torch.arange(count, dtype=each.dtype, device=each.device)
    return (angle[:, None] - angle).cos()


def _matrix(slope: Tensor, compliance: Tensor) -> Tensor:
    """∂(e − c Σ cos(β_i − β_j) f_j)/∂e, (N, k, k), from the members' slopes (N, k)."""
    identity = torch.eye(slope.shape[-1], dtype=slope.dtype, device=slope.device)
    return identity - compliance[:, None, None] * _shared(slope) * slope[:, None, :]


def _solved(matrix: Tensor, right: Tensor) -> Tensor:
    """matrix⁻¹ right of every row: (N, k, k), (N, k) → (N, k); not finite where there is none."""
    solution: Tensor = torch.linalg.solve_ex(matrix, right[..., None]).result
    return solution[..., 0]


def _each(flat: Tensor, count: int) -> Tensor:
    """(k N,) → (N, k)."""
    return flat.reshape(count, -1).T


def _flat(each: Tensor) -> Tensor:
    """(N, k) → (k N, 1)."""
    return each.T.reshape(-1, 1)
