"""Play in twist between actuator and rig: within it the actuator turns to where its own moment is nearest zero."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known, indices_if_known
from freelearn.data.states import States
from freelearn.physics.chain.prediction import Prediction
from freelearn.physics.chain.row_derivatives import rows_jacobian

# Steps of the search for a zero of the moment; a bracketed one of ordinary walls takes three or four.
MAX_ITERATIONS = 12
# A last step this small [rad] leaves an error of about its power 1.6, which the differentiable step takes away besides.
TOLERANCE = 1e-7

Values = dict[str, Tensor]
# The loads of an actuator at a state, and the values of some rows (RawVector.rows_of).
Carried = Callable[[States, Values], Prediction]
RowsOf = Callable[[Values, Tensor], Values]


def take_up(states: States, width: Tensor, values: Values, carried: Carried, rows_of: RowsOf) -> Prediction:
    """Loads on the rig of an actuator that can turn freely by ±w about the twist that the rig shows.

    width: w ≥ 0 of every row, (N,) rad. carried: the loads that the actuator hands on, those of wall, fluid and
    friction: their moment is what turns it. Derivatives are exact, of any kind.

    The actuator rests at the twist φ in [φ_rig − w, φ_rig + w] at which |M(l, φ, P)| is least. Where M vanishes in the
    band that is a zero: the one towards which the moment drives it from φ_rig (φ grows where M > 0), or else the one on
    the other side. Where it vanishes nowhere it is an end of the band, the one with the smaller |M|. M is looked at in
    φ_rig and in both ends, so that two zeros between neighbors of these three count as none. An end it is, too, where
    |M| has a least value inside the band that is not zero: nothing would hold an actuator there.

    Either way the loads keep reciprocity. At an end φ = φ_rig ± w, and they are the actuator's own there. At a zero
    M = 0 and by the implicit function theorem ∂φ/∂l = −(∂M/∂l)/(∂M/∂φ) whatever φ_rig, so that ∂F/∂φ_rig = ∂M/∂l = 0.
    One Newton step from the zero, with its slope cut from the derivative, has just this derivative (compare
    equilibrium). w = 0 changes nothing to the last bit.
    Source: Nordin & Gutman (2002), backlash as a dead zone between two shafts.
    """
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        still, reach = states.detach(), width.detach()
        start = carried(still, fixed).loads[:, 1]
        driven = torch.where(start >= 0, 1.0, -1.0).to(start)
    at_end = carried(states.replace(twist=states.twist + driven * width), values)
    with torch.no_grad():
        ahead = at_end.loads[:, 1].detach()
        bracketed = start * ahead <= 0
        behind = _behind(still, driven * reach, start, ahead, bracketed, fixed, carried, rows_of)
        # A row without play stays where it is, even at a moment of zero: nothing there depends on a zero.
        inside = (bracketed | (start * behind <= 0)) & (reach > 0)
        turned = ~inside & (behind.abs() < ahead.abs())
    band = _Band(start, ahead, behind, driven, inside)
    rows = indices_if_known(inside | turned)
    if rows is None:
        loads, status = _rest(states, width, band, values, carried)
        elsewhere = inside | turned
        return Prediction(
            torch.where(elsewhere[:, None], loads, at_end.loads), torch.where(elsewhere, status, at_end.status)
        )
    if not len(rows):
        return at_end
    loads, status = _rest(states[rows], width[rows], band.of(rows), rows_of(values, rows), carried)
    return Prediction(at_end.loads.index_copy(0, rows, loads), at_end.status.index_copy(0, rows, status))


class _Band(NamedTuple):
    """M [N·m] at the rig's twist, at the end of the band towards which it drives, and at the other; each (N,).

    driven: +1 or −1, the side of the former. inside: whether the row rests at a zero, or else at the other end."""

    start: Tensor
    ahead: Tensor
    behind: Tensor
    driven: Tensor
    inside: Tensor

    def of(self, rows: Tensor) -> _Band:
        """Some rows alone."""
        return _Band(*(value[rows] for value in self))


def _behind(
    states: States,
    reach: Tensor,
    start: Tensor,
    ahead: Tensor,
    bracketed: Tensor,
    values: Values,
    carried: Carried,
    rows_of: RowsOf,
) -> Tensor:
    """M at the end of the band that the moment drives away from, (N,).

    Rows with a zero on the other side do not need it: they have what a straight line through that side would give.
    """
    rows, straight = indices_if_known(~bracketed), 2 * start - ahead
    if rows is None:
        return carried(states.replace(twist=states.twist - reach), values).loads[:, 1]
    if not len(rows):
        return straight
    some = states[rows]
    loads = carried(some.replace(twist=some.twist - reach[rows]), rows_of(values, rows)).loads
    return straight.index_copy(0, rows, loads[:, 1])


def _rest(states: States, width: Tensor, band: _Band, values: Values, carried: Carried) -> Prediction:
    """Loads of rows that rest at a zero, or at the end of the band that the moment drives away from."""
    slopes = torch.zeros(len(states), 2, dtype=width.dtype, device=width.device)
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        still = states.detach()
        forward = band.start * band.ahead <= 0
        reach = torch.where(forward, 1.0, -1.0) * band.driven * width.detach()
        end, other = torch.where(forward, band.ahead, band.behind), torch.where(forward, band.behind, band.ahead)
        guess = still.twist + reach * _parabola(band.start, end, other)

        def moment(at: Tensor) -> Tensor:
            return carried(still.replace(twist=at), fixed).loads[:, 1]

        zero = _zero(moment, still.twist, band.start, still.twist + reach, end, guess, band.inside)
    if torch.is_grad_enabled():
        with torch.no_grad():
            slopes = _rows_slope(still.replace(twist=zero), fixed, carried)
    twist = torch.where(band.inside, zero, states.twist - band.driven * width)
    loads, status = carried(states.replace(twist=twist), values)
    # The other end, or a moment that does not change with twist: no step and no derivative through the zero.
    moves = band.inside & (slopes[:, 1] != 0)
    step = torch.where(moves, -loads[:, 1] / torch.where(moves, slopes[:, 1], 1.0), 0.0)
    return Prediction(torch.where(moves[:, None], loads + slopes * step[:, None], loads), status)


def _zero(
    moment: Callable[[Tensor], Tensor],
    low: Tensor,
    at_low: Tensor,
    high: Tensor,
    at_high: Tensor,
    guess: Tensor,
    wanted: Tensor,
) -> Tensor:
    """A zero of the moment between two twists where its signs differ: regula falsi of Anderson & Björck (1973).

    guess: where to look first. wanted: rows that have one, (n,) bool. Returns (n,) rad.
    """
    at = torch.where(at_low == 0, low, torch.where(at_high == 0, high, guess))
    for _ in range(MAX_ITERATIONS):
        value = moment(at)
        crosses = value * at_high < 0
        share = 1 - value / torch.where(at_high == 0, 1.0, at_high)
        share = torch.where(share > 0, share, 0.5)
        # The new point replaces the end of its own sign; the end that stays is made lighter.
        at_low = torch.where(crosses, at_high, at_low * share)
        low = torch.where(crosses, high, low)
        high, at_high = at, value
        difference = at_high - at_low
        target = high - value * (high - low) / torch.where(difference == 0, 1.0, difference)
        target = torch.where(value == 0, at, target)
        left = wanted & ((target - at).abs() > TOLERANCE)
        at = target
        if all_if_known(~left):
            break
    return at


def _parabola(start: Tensor, end: Tensor, other: Tensor) -> Tensor:
    """The zero in [0, 1] of the parabola through start at 0, end at 1 and other at −1; each (n,)."""
    bend, slope = (end + other) / 2 - start, (end - other) / 2
    root = (slope * slope - 4 * bend * start).clamp_min(0).sqrt()
    # −2 f/(slope ± root): the form that does not divide by a vanishing bend.
    below = slope + torch.where(slope >= 0, root, -root)
    first = -2 * start / torch.where(below == 0, 1.0, below)
    second = -below / torch.where(bend == 0, 1.0, 2 * bend)
    share = torch.where((first >= 0) & (first <= 1), first, second)
    return share.nan_to_num(nan=0.5).clamp(0, 1)


def _rows_slope(states: States, values: Values, carried: Carried) -> Tensor:
    """∂(F, M)/∂φ of every row, (N, 2)."""

    def loads(at: Tensor) -> Tensor:
        return carried(states.replace(twist=at[:, 0]), values).loads

    return rows_jacobian(loads, states.twist[:, None])[1][..., 0].detach()
