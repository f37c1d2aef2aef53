"""The pressures for what is wanted of an actuator, as functions with a fixed number of operations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import torch
from torch import Tensor

from freelearn.export.actuator import UNITS, Actuator, name_of
from freelearn.export.arithmetic.function import Function, Port, pruned
from freelearn.export.arithmetic.loops import repeated
from freelearn.export.arithmetic.trace import traced
from freelearn.export.forward import Banded, inverted
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.bands import SAME

# The search for a pressure: parts of its span that are looked through, and turns in the one with a solution.
PARTS, TURNS = 24, 24
# The search for several pressures: linearizations, and last steps to the loads. With more pressures there are too many
# faces of their box.
ROUNDS, LAST, MOST = 40, 4, 5
# The longest step of a pressure, as a share of its span.
LONGEST = 0.25
# What the square of a miss, in scales of the loads, counts in beside the squares of shares of the pressures' span.
MISSED = 1e-10
# Beside the diagonal of what is solved, as a share of it, and at least.
RIDGE, LEAST = 1e-14, 1e-30
# A miss that counts as none, as a share of the largest of that load.
MET = 1e-9
FOUND = Port("found", "1", "1 where there is one within the pressures that were measured and a twentieth more")
INSIDE = Port("inside", "1", "1 where the data that the model was fitted on reach")


def inverses(actuator: Actuator) -> list[Function]:
    """Of an actuator that is asked for its loads, or of a network that answers with what it was fitted to. What its bed
    neither measures nor imposes is no answer to go by."""
    bed = actuator.fitted.bed
    known = [name_of(quantity) for quantity in (*bed.measured, *bed.state)]
    told = [i for i, port in enumerate(actuator.answered) if port.name in known]
    count = len(actuator.states.members)
    if count > MOST:
        return []
    both = [tuple(told)] if len(told) == 2 and count > 1 else []
    return [inverse(actuator, given) for given in (*both, *((i,) for i in told))]


def inverse(actuator: Actuator, given: tuple[int, ...]) -> Function:
    """The least pressures for some of its answers, by their numbers: of an actuator alone for one of them."""
    return _several(actuator, given) if actuator.states.members else _one(actuator, *given)


def _one(actuator: Actuator, given: int) -> Function:
    """The least pressure at which one answer is what is wanted, all else that is imposed held."""
    low, high = (float(edge[2]) for edge in actuator.span.looked)
    bands, values, _ = actuator.fitted.bands, actuator.system.values, (actuator.edges, actuator.rest)
    answer, which = actuator.answered[given], actuator.shown[given]
    banded = Banded.from_miss(bands.miss, actuator.system) if bands else None
    factor = bands.miss.factors((2,), (which,), SAME)[0] if bands else None

    def found(*inputs: Tensor) -> list[Tensor]:
        wanted, rest = inputs[2], inputs[3:]

        def lacking(pressure: Tensor) -> Tensor:
            system, x, _ = actuator.place((*inputs[:2], pressure, *rest))
            loads, status = system.recorded(x, values)
            return torch.where(status == Status.OK, loads[:, which] - wanted, torch.nan)

        def slope(pressure: Tensor) -> Tensor:
            system, x, _ = actuator.place((*inputs[:2], pressure, *rest))
            return system.recorded_slopes(x, values)[1][:, which, 2]

        pressure, there = _least_zero(lacking, slope, low, high, wanted)
        system, x, _ = actuator.place((*inputs[:2], pressure, *rest))
        loads, slopes = system.recorded_slopes(x, values)
        rate = slopes[:, which, 2]
        moves = there & (rate != 0)
        polished = pressure - torch.where(moves, (loads[:, which] - wanted) / torch.where(moves, rate, 1.0), 0.0)
        half = []
        if banded is not None and factor is not None:
            half = [factor * banded.deviations(system, x, slopes)[:, which] / rate.abs()]
        at = torch.stack([x[:, 0], x[:, 1], polished], dim=-1)
        return [polished, there.to(torch.float64), actuator.inside(at).to(torch.float64), *half]

    ports = (*actuator.imposed[:2], Port(answer.name, answer.unit, f"the {answer.name} wanted"), *actuator.memory)
    graph, nodes = traced(found, len(ports), f"The inverse of model {actuator.fitted.title}")
    name, others = answer.name, " and ".join(p.name for p in actuator.imposed[:2])
    out = [
        Port("pressure", "Pa", f"the least pressure at which the {name} is that; at the nearest end where none is"),
        FOUND,
        INSIDE,
        *([Port("pressure_half_band", "Pa", "half of the 95 % band of the pressure")] if banded else []),
    ]
    about = f"the pressure for {name}, {others} held"
    inputs = pruned(graph, nodes, ports, 3)
    return Function(f"pressure_for_{name}", about, inputs, tuple(out), graph, tuple(i for some in nodes for i in some))


def _least_zero(
    lacking: Callable[[Tensor], Tensor], slope: Callable[[Tensor], Tensor], low: float, high: float, like: Tensor
) -> tuple[Tensor, Tensor]:  # fmt: skip
    """The zero in [low, high] of a function of the pressure that is nearest to none, and whether there is one; else the
    nearer end.

    Each part is looked at where the function turns in it, as its slopes at both ends have it, or else in its middle."""
    step = (high - low) / PARTS
    begin = torch.full_like(like, low)
    first = lacking(begin)

    def scan(carried: list[Tensor]) -> list[Tensor]:
        at, before, rising, left, right, at_left, at_right, nearest = carried
        further = at + step
        value, goes_on = lacking(further), slope(further)
        turns = rising * goes_on < 0
        between = at + step * torch.where(turns, rising / torch.where(turns, rising - goes_on, 1.0), 0.5)
        value_between = lacking(between)
        lower, upper = before * value_between <= 0, value_between * value <= 0
        # How near to no pressure at all it is, as far as a part tells.
        start, end = torch.where(lower, at, between), torch.where(lower, between, further)
        near = torch.where((start <= 0) & (end >= 0), 0.0, torch.minimum(start.abs(), end.abs()))
        new = (lower | upper) & (near < nearest)
        left, right = torch.where(new, start, left), torch.where(new, end, right)
        at_left = torch.where(new, torch.where(lower, before, value_between), at_left)
        at_right = torch.where(new, torch.where(lower, value_between, value), at_right)
        return [further, value, goes_on, left, right, at_left, at_right, torch.where(new, near, nearest)]

    none = torch.full_like(like, torch.inf)
    start = [begin, first, slope(begin), begin, begin, first, first, none]
    _, last, _, left, right, at_left, at_right, nearest = repeated(scan, start, PARTS)
    there = nearest < torch.inf

    # Regula falsi of Anderson & Björck (1973), as play has it.
    def narrow(carried: list[Tensor]) -> list[Tensor]:
        lower, at_lower, upper, at_upper = carried
        difference = at_upper - at_lower
        at = upper - at_upper * (upper - lower) / torch.where(difference == 0, 1.0, difference)
        at = torch.where(at_upper == 0, upper, at)
        value = lacking(at)
        crosses = value * at_upper < 0
        share = 1 - value / torch.where(at_upper == 0, 1.0, at_upper)
        share = torch.where(share > 0, share, 0.5)
        at_lower = torch.where(crosses, at_upper, at_lower * share)
        return [torch.where(crosses, upper, lower), at_lower, at, value]

    _, _, pressure, _ = repeated(narrow, [left, at_left, right, at_right], TURNS)
    nearer = torch.where(last.abs() < first.abs(), high, low)
    return torch.where(there, pressure, nearer), there


def _several(actuator: Actuator, given: tuple[int, ...]) -> Function:
    """The least pressures, Σ (p/span)², at which an end block's loads are what is wanted, its place held.

    Each round takes the loads as straight lines through where it is, and finds the least pressures on them within the
    span. The last steps are of the pressures that are at no end of it."""
    count = len(actuator.states.members)
    low, high = (edge[2:] for edge in actuator.span.looked)
    size = high - low
    floor, roof = low / size, high / size
    faces = _Faces.from_box(floor, roof, len(given))
    scale = actuator.fitted.asker.scale[list(given)]
    bands, values, _ = actuator.fitted.bands, actuator.system.values, (actuator.edges, actuator.rest)
    banded = Banded.from_miss(bands.miss, actuator.system) if bands else None
    factors = (
        bands.miss.factors(tuple(range(2, 2 + count)), given, actuator.fitted.asker.scale)[:count] if bands else None
    )

    def found(*inputs: Tensor) -> list[Tensor]:
        place, wanted = inputs[:2], torch.stack(list(inputs[2 : 2 + len(given)]), dim=-1)
        rest = inputs[2 + len(given) :]

        def loads(share: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
            """At pressures (1, k) in spans: the miss and its derivatives, in scales, and the model's x and slopes."""
            system, x, _ = actuator.place((*place, *(share * size).unbind(-1), *rest))
            y, slopes = system.recorded_slopes(x, values)
            picked = slopes[:, list(given)]
            return (y[:, list(given)] - wanted) / scale, picked[:, :, 2:] * size / scale[:, None], x, slopes

        def round_(carried: list[Tensor]) -> list[Tensor]:
            miss, rate, _, _ = loads(carried[0])
            to = faces.least(rate, (rate * carried[0][:, None, :]).sum(-1) - miss)
            return [carried[0] + (to - carried[0]).clamp(-LONGEST, LONGEST)]

        (share,) = repeated(round_, [torch.zeros(1, count, dtype=torch.float64) + 0.0 * wanted[:, :1]], ROUNDS)
        free = ((share > floor) & (share < roof)).to(torch.float64)

        def last(carried: list[Tensor]) -> list[Tensor]:
            miss, rate, _, _ = loads(carried[0])
            part = rate * free[:, None, :]
            step = (part * _solved(part, -miss)[:, :, None]).sum(1)
            return [_clipped(carried[0] + step, floor, roof)]

        (share,) = repeated(last, [share], LAST)
        miss, _, x, slopes = loads(share)
        there = (miss.abs() <= MET).all(-1)
        pressures = share * size
        found = [pressures, there.to(torch.float64), actuator.inside(x).to(torch.float64)]
        if banded is not None and factors is not None:
            # Of all pressures, as invert has it: their pseudoinverse on the loads given.
            across = slopes[:, list(given)][:, :, 2:]
            square = across @ across.transpose(1, 2)
            one = inverted(square) if len(given) == 2 else 1 / square
            moved = -across.transpose(1, 2) @ one
            maps = torch.stack(
                [moved[:, :, given.index(i)] if i in given else 0 * moved[:, :, 0] for i in (0, 1)], dim=-1
            )
            found.append(
                factors * banded.deviations(actuator.place((*place, *pressures.unbind(-1), *rest))[0], x, slopes, maps)
            )
        return found

    names = [actuator.answered[i].name for i in given]
    ports = (
        *actuator.imposed[:2],
        *(Port(n, UNITS[n], f"the {n} wanted") for n in names),
        *actuator.memory,
    )
    graph, nodes = traced(found, len(ports), f"The inverse of model {actuator.fitted.title}")
    wanted = " and ".join(names)
    out = [
        *(
            Port(p.name, "Pa", f"of the least pressures (sum of squares) at which {wanted} are that")
            for p in actuator.imposed[2:]
        ),
        Port(
            "found",
            "1",
            "1 where there are such within the pressures that were measured and a twentieth more; else nearest",
        ),
        INSIDE,
        *(Port(f"{p.name}_half_band", "Pa", "half of the 95 % band") for p in actuator.imposed[2:] if banded),
    ]
    name = "pressures_for_loads" if len(given) == 2 else f"pressures_for_{names[0]}"
    inputs = pruned(graph, nodes, ports, 2 + len(given))
    about = f"the least pressures for {wanted}, elongation and twist held"
    return Function(name, about, inputs, tuple(out), graph, tuple(i for some in nodes for i in some))


def _clipped(x: Tensor, low: Tensor, high: Tensor) -> Tensor:
    return torch.minimum(torch.maximum(x, low), high)


@dataclass(frozen=True)
class _Faces:
    """Faces of a box of shares: on which some are at an end and so many as there are equations, or more, are free.
    free (f, k): 1 where one is; fixed (f, k): the end where it is not; low, high (k,): of the box."""

    free: Tensor
    fixed: Tensor
    low: Tensor
    high: Tensor

    @classmethod
    def from_box(cls, low: Tensor, high: Tensor, equations: int) -> _Faces:
        free, fixed = [], []
        for face in product((None, 0, 1), repeat=len(low)):
            if face.count(None) >= equations:
                free.append([float(f is None) for f in face])
                fixed.append([0.0 if f is None else float((low, high)[f][i]) for i, f in enumerate(face)])
        return cls(torch.tensor(free, dtype=low.dtype), torch.tensor(fixed, dtype=low.dtype), low, high)

    def least(self, rate: Tensor, goal: Tensor) -> Tensor:
        """The least shares (1, k) with rate · shares = goal: rate (1, e, k), goal (1, e). Where there are none in the
        box, those that miss it least."""
        some = rate * self.free[:, None, :]
        rest = goal - (rate * self.fixed[:, None, :]).sum(-1)
        shares = self.fixed + (some * _solved(some, rest)[:, :, None]).sum(1)
        shares = _clipped(shares, self.low, self.high)
        missed = (rate * shares[:, None, :]).sum(-1) - goal
        value = (missed * missed).sum(-1) / MISSED + (shares * shares).sum(-1)
        # Several faces may hold the same shares.
        best = (value <= value.amin()).to(shares.dtype)
        return ((best[:, None] * shares).sum(0) / best.sum())[None]


def _solved(a: Tensor, goal: Tensor) -> Tensor:
    """(a aᵀ)⁻¹ goal of every row: a (N, e, k), goal (N, e), of one or two equations e."""
    square = (a[:, :, None, :] * a[:, None, :, :]).sum(-1)
    equations = goal.shape[1]
    # Where nothing is free to move nothing is to be divided by zero.
    ridge = RIDGE * torch.diagonal(square, dim1=-2, dim2=-1).sum(-1) + LEAST
    if equations == 1:
        return goal / (square[:, :, 0] + ridge[:, None])
    square = square + ridge[:, None, None] * torch.eye(2, dtype=torch.float64)
    return (inverted(square) * goal[:, None, :]).sum(-1)
