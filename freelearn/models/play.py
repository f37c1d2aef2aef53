"""Play in twist between actuator and rig: within it the actuator turns to where its own moment is nearest zero."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.prediction import Prediction

# Steps of the search for a zero of the moment; a bracketed one of ordinary walls takes three.
MAX_ITERATIONS = 12
# A twist this near a zero [rad] leaves an error of about its square, which the differentiable step takes away besides.
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

    Either way the potential of the chain is a value of min_φ Π(l, φ, P) over the band, so that loads keep reciprocity:
    at an end φ = φ_rig ± w, and the loads are those of the actuator there; at a zero M = 0 and by the implicit function
    theorem ∂φ/∂l = −(∂M/∂l)/(∂M/∂φ), whatever φ_rig, so that ∂F/∂φ_rig = ∂M/∂l = 0. One Newton step from the zero,
    with its slope cut from the derivative, has just this derivative (compare mechanics.equilibrium). w = 0 changes
    nothing to the last bit. Source: Nordin & Gutman (2002), backlash as a dead zone between two shafts.
    """
    with torch.no_grad():
        fixed = {name: value.detach() for name, value in values.items()}
        still = states.detach()
        side, zero, inside = _rest(still, width.detach(), fixed, carried, rows_of)
        slopes = _slopes(still.replace(twist=zero), inside, fixed, carried, rows_of)
    twist = torch.where(inside, zero, states.twist + side * width)
    loads, status = carried(states.replace(twist=twist), values)
    # An end, or a moment that does not change with twist: no step and no derivative through the zero.
    moves = inside & (slopes[:, 1] != 0)
    step = torch.where(moves, -loads[:, 1] / torch.where(moves, slopes[:, 1], 1.0), 0.0)
    stepped = loads + slopes * step[:, None]
    return Prediction(torch.where(moves[:, None], stepped, loads), status)


def _rest(
    states: States, width: Tensor, values: Values, carried: Carried, rows_of: RowsOf
) -> tuple[Tensor, Tensor, Tensor]:
    """Where every row's actuator rests: side (+1, −1: that end of the band), zero [rad], inside; each (N,)."""

    def moment(at: Tensor) -> Tensor:
        return carried(states.replace(twist=at), values).loads[:, 1]

    here = states.twist
    start = moment(here)
    driven = torch.where(start >= 0, 1.0, -1.0).to(here)
    ahead, behind = here + driven * width, here - driven * width
    at_ahead, at_behind = moment(ahead), moment(behind)
    forward, backward = start * at_ahead <= 0, start * at_behind <= 0
    # A row without play stays where it is, even at a moment of zero: nothing there depends on a zero.
    inside = (forward | backward) & (width > 0)
    side = torch.where(at_behind.abs() < at_ahead.abs(), -driven, driven)
    end, at_end = torch.where(forward, ahead, behind), torch.where(forward, at_ahead, at_behind)
    other, at_other = torch.where(forward, behind, ahead), torch.where(forward, at_behind, at_ahead)
    guess = _parabola(here, start, end, at_end, other, at_other)
    points = torch.stack([here, start, end, at_end, guess])
    rows = _rows(inside)
    if rows is None:
        return side, torch.where(inside, _zero(moment, points), here), inside
    if not len(rows):
        return side, here, inside
    some, part = states[rows], rows_of(values, rows)
    zero = _zero(lambda at: carried(some.replace(twist=at), part).loads[:, 1], points[:, rows])
    return side, here.index_copy(0, rows, zero), inside


def _zero(moment: Callable[[Tensor], Tensor], points: Tensor) -> Tensor:
    """A zero of the moment between two twists where its signs differ: regula falsi of Anderson & Björck (1973).

    points: (5, n): a twist and its moment, the other, and a first guess. Returns (n,).
    """
    low, at_low, high, at_high, guess = points
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
        done = (value == 0) | ((target - at).abs() <= TOLERANCE)
        at = torch.where(value == 0, at, target)
        if _rows(~done) is not None and not bool((~done).any()):
            break
    return at


def _parabola(x0: Tensor, f0: Tensor, x1: Tensor, f1: Tensor, x2: Tensor, f2: Tensor) -> Tensor:
    """The zero between x0 and x1 of the parabola through three points, x0 midway between the others; each (N,)."""
    reach = x1 - x0
    bend, slope = (f1 + f2) / 2 - f0, (f1 - f2) / 2
    root = (slope * slope - 4 * bend * f0).clamp_min(0).sqrt()
    # −2 f0/(slope ± root): the form that does not divide by a vanishing bend.
    below = slope + torch.where(slope >= 0, root, -root)
    first = -2 * f0 / torch.where(below == 0, 1.0, below)
    second = -below / torch.where(bend == 0, 1.0, 2 * bend)
    share = torch.where((first >= 0) & (first <= 1), first, second).clamp(0, 1)
    return x0 + reach * share.nan_to_num(nan=0.5)


def _slopes(states: States, inside: Tensor, values: Values, carried: Carried, rows_of: RowsOf) -> Tensor:
    """∂(F, M)/∂φ in the rows that rest at a zero, (N, 2); zero in the others."""
    rows = _rows(inside)
    if rows is None:
        return torch.where(inside[:, None], _rows_slope(states, values, carried), 0.0)
    slopes = torch.zeros(len(inside), 2, dtype=states.twist.dtype, device=states.twist.device)
    if not len(rows):
        return slopes
    return slopes.index_copy(0, rows, _rows_slope(states[rows], rows_of(values, rows), carried))


def _rows_slope(states: States, values: Values, carried: Carried) -> Tensor:
    """∂(F, M)/∂φ of every row, (N, 2), by two reverse passes, since no row depends on another."""

    def loads(at: Tensor) -> Tensor:
        return carried(states.replace(twist=at), values).loads

    value, pull = torch.func.vjp(loads, states.twist)  # type: ignore[misc]
    unit = torch.eye(2, dtype=value.dtype, device=value.device)
    return torch.stack([pull(unit[i].expand_as(value))[0] for i in (0, 1)], dim=-1).detach()


def _rows(mask: Tensor) -> Tensor | None:
    """Numbers of the marked rows, (n,) int64; None inside vmap, where nobody can know."""
    try:
        return torch.nonzero(mask)[:, 0]
    except RuntimeError:
        return None
