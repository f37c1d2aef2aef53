"""Generic shapes that something missing may leave in residuals: polynomials, bins, waves, and in a log a history."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import comb

import torch
from torch import Tensor

from freelearn.data.recordings import Recording, stopped
from freelearn.data.states import States
from freelearn.physics.chain.lags import lag

# Shapes that a missing history may leave in a log: what is imposed, late by several times and held back by plays.

# Times of lags from the usual step from row to row to this share of the longest recording.
LAGS, SHORTEST, LONGEST = 5, 0.5, 0.3
# Half widths of plays, of the range of what is imposed.
PLAYS = (0.02, 0.1, 0.4)
# A quantity that changes by less than this share of its size within every recording stays as it is.
STILL = 1e-6


def history(states: States) -> Tensor:
    """Columns (N, k) of rows of a log; none of another table.

    By how much each quantity imposed is ahead of its lag, for several times, and what plays hold back of it, these also
    in proportion to what is imposed. What a gauge flickers by is in the residual of its row, and no history: each row's
    shapes are those of the other rows' readings, its own and every second one about it taken from the line through its
    neighbors.
    """
    if states.recording is None or states.place is None:
        return torch.zeros(len(states), 0, dtype=torch.float64)
    recording, place = states.recording.around(states.place)
    read = torch.stack([_scaled(x) for x in recording.states.inputs()], dim=1)
    moving = recording.change(recording.calmed(read)).abs().amax(0) > STILL
    second = torch.arange(len(read)) % 2 == 1
    each = (recording.calmed(_between(read, recording, own)) for own in (~second, second))
    even, odd = (_past(recording, inputs, moving) for inputs in each)
    return torch.where(second[:, None], odd, even)[place]


def _between(read: Tensor, recording: Recording[States], own: Tensor) -> Tensor:
    """Readings (N, k) with those of some rows, (N,) bool, no two of which follow each other, on the line through the
    rows before and after; a recording's ends stay."""
    inside = torch.zeros_like(own)
    inside[1:-1] = own[1:-1] & ~recording.first[1:-1] & ~recording.first[2:]
    at = torch.nonzero(inside)[:, 0]
    time = recording.time
    share = ((time[at] - time[at - 1]) / (time[at + 1] - time[at - 1]))[:, None]
    return read.index_copy(0, at, (1 - share) * read[at - 1] + share * read[at + 1])


def _past(recording: Recording[States], inputs: Tensor, moves: Tensor) -> Tensor:
    """What depends on the past of inputs (N, m), of which some move, (m,) bool: (N, k)."""
    moving = inputs[:, moves]
    late = [lag(moving, recording, moving.new_tensor(t)) for t in times(recording)]
    free = ~recording.first[:, None]
    held = [stopped(moving, *(torch.where(free, sign * w, 0.0).expand_as(moving) for sign in (-1, 1))) for w in PLAYS]
    # A play's width may depend on where the actuator is.
    each = torch.cat([*late, *held], dim=1)
    sloped = torch.cat(held, dim=1)
    varied = [sloped * x[:, None] for x in inputs.unbind(1)]
    columns: Tensor = torch.cat([each, *varied], dim=1)
    return columns


def _scaled(x: Tensor) -> Tensor:
    """x (N,) moved and stretched to [0, 1]; zeros where all values are the same."""
    wide = x.max() - x.min()
    return (x - x.min()) / wide if float(wide) > 0 else torch.zeros_like(x)


def times(recording: Recording[States]) -> list[float]:
    """Of the lags that a missing history may have, from the shortest to the longest [s]."""
    begun, ended = recording.ends
    longest = float((recording.time[ended] - recording.time[begun]).max())
    steps = recording.step[recording.step > 0]
    shortest = SHORTEST * float(steps.median()) if len(steps) else 1.0
    return torch.logspace(0, 1, LAGS, base=max(LONGEST * longest / shortest, 1.0)).mul(shortest).tolist()


# Generic shapes that something missing may leave in residuals: polynomials, bins, waves.

# Highest total degree of the polynomials in length, twist and pressure: over all samples together, of each alone.
POOLED_DEGREE, SAMPLE_DEGREE = 4, 3
# Bins of length and of twist in which a misfit of any shape may show, and half-waves over a sample's run.
BINS, WAVES = 24, 6
# Rows or kinematic states for each shape where single readings and position errors are to be told from it, and fewest
# bins that are worth having.
SHARING, FEWEST_BINS = 4, 4
# Where several pressures leave too few rows for polynomials in all of them, powers of each alone up to this one: what a
# block's actuators do adds up. Rows for each shape then.
HIGHEST_ALONE, SHARING_ALONE = 3, 3


# Share of a pressure's range by which it is moved to see how shapes change with it.
MOVED = 1e-4


@dataclass(frozen=True)
class Block:
    """Shapes (n, k) on some rows, (n,) of them, and zero on all others. slopes: how they change with the pressure of
    each actuator in their row, (pressures, n, k) 1/Pa, where that is asked for."""

    rows: Tensor
    columns: Tensor
    slopes: Tensor | None = None


# A set of shapes: what belongs to one sample alone costs no more than its own rows.
Basis = list[Block]


def scaled(x: Tensor) -> Tensor:
    """x (N,) moved and stretched to [−1, 1]; zeros where all values are the same.

    >>> scaled(torch.tensor([2.0, 3.0, 4.0]))
    tensor([-1.,  0.,  1.])
    """
    low, high = x.min(), x.max()
    half = (high - low) / 2
    return (x - (low + high) / 2) / half if float(half) > 0 else torch.zeros_like(x)


def elongation(states: States) -> Tensor:
    """Length change l − L [m], (N,)."""
    return states.length - states.reference_length


def imposed(states: States) -> dict[str, Tensor]:
    """What the bed imposes, by name, (N,) each: the two quantities of a kinematic state (its length as a change), then
    the pressure of each actuator."""
    inputs = states.inputs()
    names = [quantity.name for quantity in states.bed.state]
    count = len(inputs) - 2
    names += ["pressure"] if count == 1 else [f"pressure {i + 1}" for i in range(count)]
    named = dict(zip(names, inputs, strict=True))
    return named | ({"elongation": elongation(states)} if "elongation" in named else {})


def monomials(states: States, degree: int) -> tuple[Tensor, list[str]]:
    """Products of powers of what is imposed up to a total degree: (N, k)."""
    return _monomials(imposed(states), degree)


def _monomials(inputs: Mapping[str, Tensor], degree: int) -> tuple[Tensor, list[str]]:
    """The same of some inputs (N,), each scaled to [−1, 1]."""
    named = {name: scaled(x) for name, x in inputs.items()}
    one = torch.ones_like(next(iter(named.values())))
    columns, names = [], []
    for powers in _powers(len(named), degree):
        parts = [(name, p) for name, p in zip(named, powers, strict=True) if p]
        column = one
        for name, p in parts:
            column = column * named[name] ** p
        columns.append(column)
        names.append(" × ".join(name if p == 1 else f"{name}^{p}" for name, p in parts) or "constant")
    return torch.stack(columns, dim=-1), names


def _powers(count: int, degree: int) -> list[tuple[int, ...]]:
    """Exponents of `count` factors whose sum is at most the degree.

    >>> _powers(2, 1)
    [(0, 0), (0, 1), (1, 0)]
    """
    if not count:
        return [()]
    return [(i, *rest) for i in range(degree + 1) for rest in _powers(count - 1, degree - i)]


def bases(states: States) -> list[Basis]:
    """Shapes that a missing effect may leave: coarse and fine smooth ones, uneven ones, and each sample's own."""
    return list(_bases(states, history(states)))


def bases_with_slopes(states: States) -> Iterator[Basis]:
    """The same with their slopes, one after another; what a log's history leaves is counted as known."""
    past, inputs = history(states), states.inputs()
    moved, steps = [], []
    for place, pressure in enumerate(inputs[2:], 2):
        # The ends stay, so that what shapes are scaled by does.
        between = (pressure > pressure.min()) & (pressure < pressure.max())
        steps.append(MOVED * float(pressure.max() - pressure.min()) or 1.0)
        other = [*inputs[:place], pressure + steps[-1] * between, *inputs[place + 1 :]]
        moved.append(_bases(states.with_inputs(other), past))
    for basis, *others in zip(_bases(states, past), *moved, strict=True):
        yield [
            replace(
                block,
                slopes=torch.stack([(b.columns - block.columns) / step for b, step in zip(same, steps, strict=True)]),
            )
            for block, *same in zip(basis, *others, strict=True)
        ]


def _bases(states: States, past: Tensor) -> Iterator[Basis]:
    """past (N, j): what a missing history may leave."""
    rising = states.direction[:, None]
    low, _ = monomials(states, 1)
    order = torch.linspace(-1, 1, len(states), dtype=torch.float64)[:, None]

    def smooth(degree: int) -> Tensor:
        return torch.cat([monomials(states, degree)[0], rising * low, order], dim=1)

    everywhere = torch.arange(len(states))
    yield [Block(everywhere, smooth(2))]
    yield [Block(everywhere, smooth(POOLED_DEGREE))]
    yield [
        Block(everywhere, torch.cat([*(binned(x, states) for x in _places(states).values()), _waves(states)], dim=1))
    ]
    if past.shape[1]:
        yield [Block(everywhere, past)]
    if len(torch.unique(states.sample)) > 1:
        each = smooth(SAMPLE_DEGREE)
        yield [Block(rows, each[rows]) for rows in rows_of_samples(states)]


def rows_of_samples(states: States) -> list[Tensor]:
    """Row numbers of each sample, in the samples' order."""
    return [torch.nonzero(states.sample == n)[:, 0] for n in torch.unique(states.sample)]


def generic(states: States, visits: int) -> tuple[Tensor, Tensor]:
    """Shapes that something missing may leave in one sample's residuals, (n, k), and the kind of each, (k,) int64.

    visits: number of its kinematic states. As many shapes as the rows bear: SHARING rows for each polynomial, and as
    many states for each bin and wave, or they would take their position errors and single readings.
    """
    axes = len(imposed(states))
    degree = max(d for d in range(POOLED_DEGREE + 1) if comb(d + axes, axes) * SHARING <= len(states) or d == 0)
    low, _ = monomials(states, 1)
    order = torch.linspace(-1, 1, len(states), dtype=torch.float64)[:, None]
    smooth = monomials(states, degree)[0]
    smooth = torch.cat([smooth, *_powers_alone(states, degree, len(states) // SHARING_ALONE - smooth.shape[1])], dim=1)
    kinds = [smooth, torch.cat([states.direction[:, None] * low, order], dim=1)]
    bearable = min(visits // SHARING, BINS)
    if bearable >= FEWEST_BINS:
        kinds += [binned(x, states, bearable) for x in _places(states).values()]
    kinds.append(_waves(states, min(bearable, WAVES)))
    kinds.append(history(states))
    kind = torch.cat([torch.full((columns.shape[1],), i) for i, columns in enumerate(kinds)])
    return torch.cat(kinds, dim=1), kind


def _powers_alone(states: States, degree: int, most: int) -> list[Tensor]:
    """Powers above a degree of each of several pressures, (N, pressures) each; at most so many columns in all."""
    pressures = torch.stack([scaled(x) for x in states.inputs()[2:]], dim=1)
    count = pressures.shape[1]
    if count == 1:
        return []
    return [pressures**power for power in range(degree + 1, HIGHEST_ALONE + 1) if count * (power - degree) <= most]


def _places(states: States) -> dict[str, Tensor]:
    """The two quantities of a kinematic state."""
    return dict(list(imposed(states).items())[:2])


def place_shapes(states: States) -> Tensor:
    """Functions of the place alone, of one row for each kinematic state (n,): a constant, polynomials and bins, (n, k),
    as many as the states bear."""
    places, bearable = _places(states), len(states) // SHARING
    degree = max(d for d in range(SAMPLE_DEGREE + 1) if comb(d + 2, 2) < bearable or d == 0)
    smooth, _ = _monomials(places, degree)
    most = min((bearable - smooth.shape[1] - 1) // 2, BINS // 2)
    uneven = [bins(x, most) for x in places.values() if most >= FEWEST_BINS and float(x.max()) > float(x.min())]
    return torch.cat([smooth, *uneven], dim=1)


def dense(basis: Basis, count: int) -> Tensor:
    """The shapes as one matrix over all rows, (count, k)."""
    parts = []
    for block in basis:
        part = torch.zeros(count, block.columns.shape[1], dtype=torch.float64)
        part[block.rows] = block.columns
        parts.append(part)
    return torch.cat(parts, dim=1)


def bins(x: Tensor, most: int = BINS) -> Tensor:
    """Indicators (N, k) of the levels of x (N,), or of at most so many bins with equally many levels each.

    >>> bins(torch.tensor([0.5, 2.0, 0.5]))
    tensor([[1., 0.],
            [0., 1.],
            [1., 0.]], dtype=torch.float64)
    """
    levels, level = torch.unique(x.round(decimals=9), return_inverse=True)
    if len(levels) > most:
        level = torch.div(level * most, len(levels), rounding_mode="floor")
    return torch.nn.functional.one_hot(level).double()


def binned(x: Tensor, states: States, most: int = BINS) -> Tensor:
    """A constant and a slope over pressure in each bin of x: what polynomials are too smooth for, (N, 2 bins)."""
    inside = bins(x, most)
    return torch.cat([inside, inside * scaled(states.pressure)[:, None]], dim=1)


def _waves(states: States, most: int = WAVES) -> Tensor:
    """Slow waves over each sample's run, in the order of measuring: (N, most × samples)."""
    columns = [torch.zeros(len(states), 0, dtype=torch.float64)]
    for n in torch.unique(states.sample):
        inside = states.sample == n
        place = (torch.cumsum(inside, 0) - 0.5).double() / inside.sum()
        columns += [(torch.cos(torch.pi * k * place) * inside)[:, None] for k in range(1, most + 1)]
    return torch.cat(columns, dim=1)


def both_loads(force: Tensor, moment: Tensor) -> Tensor:
    """Shapes of the force (N, k) and of the moment (N, j) as loads (N, 2, k + j), each with the other zero."""
    none = torch.zeros(len(force), force.shape[1] + moment.shape[1], dtype=force.dtype)
    loads = torch.stack([none, none], dim=1)
    loads[:, 0, : force.shape[1]] = force
    loads[:, 1, force.shape[1] :] = moment
    return loads
