"""What the measuring alone does to the loads: the noise floor, and residuals whitened by it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.common.progress import tell
from freelearn.data.accuracy import Accuracy
from freelearn.data.bed_accuracy import sensors, shared
from freelearn.data.beds import KINEMATIC, Bed
from freelearn.data.levels import Levels
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.noise.linear_algebra import Shared
from freelearn.discovery.noise.memory import Filter
from freelearn.discovery.noise.scatter import Scatter, clock_of
from freelearn.discovery.noise.shapes import both_loads
from freelearn.physics.chain.log_derivatives import shifted
from freelearn.physics.chain.model import BLOCK, Model

# Precision of a reading, in units of the stated one, below which it counts for nothing: ever smaller ones end in
# numbers that cannot be told from zero, and what is divided by them in none.
LEAST = 1e-12


def sensitivities(model: Model, states: States) -> Tensor:
    """∂(F, M)/∂(l, φ, P) of every row at the model's present parameters: (N, 2, 3). Zero where there is no answer.

    Of other beds: of what they measure by what they impose, (N, 2, 2 + pressures), see States.inputs. Of a log, length
    and twist are those of a whole recording."""
    return torch.cat(list(_sensitivities(model, states)))


def variances(model: Model, states: States, accuracy: Accuracy, present: Tensor) -> Tensor:
    """Of each reading, (N, 2) SI: the whitener's `variance`, without all that it needs besides for many rows.

    present: (N, 2) bool, readings that there are."""
    variance, start = torch.empty(present.shape, dtype=torch.float64), 0
    for part in _sensitivities(model, states):
        rows = slice(start, start + len(part))
        own, position = _parts(part, accuracy, states.bed, present[rows])
        variance[rows] = torch.where(present[rows], own + position.square().sum(-1), 0.0)
        start = rows.stop
        tell("evaluating", start, len(states))
    return variance


def own_variances(model: Model, states: States, accuracy: Accuracy) -> Tensor:
    """Of what each row's readings err in by themselves, without the position error that the rows of a state share:
    (N, 2) SI."""
    every = torch.ones((len(states), 2), dtype=torch.bool)
    return _parts(sensitivities(model, states), accuracy, states.bed, every)[0]


def _parts(sensitivity: Tensor, accuracy: Accuracy, bed: Bed, told: Tensor) -> tuple[Tensor, Tensor]:
    """Variances (N, 2) of what each row errs in by itself, and what its state's position error does to it, (N, 2, 2),
    as far as it is told by a reading (N, 2)."""
    by_pressure = sensitivity[:, :, 2:] * accuracy.pressure
    own = sensors(accuracy, bed) ** 2 + by_pressure.square().sum(-1)
    return own, torch.where(told[..., None], sensitivity[:, :, :2], 0.0) * shared(accuracy, bed)


def _sensitivities(model: Model, states: States) -> Iterator[Tensor]:
    values = {name: value.detach() for name, value in model.values().items()}
    whole = shifted(model, states, values) if model.remembers(states) else None
    for start in range(0, max(len(states), 1), BLOCK):
        part = states[start : start + BLOCK]
        with torch.enable_grad():
            inputs = [x.detach().requires_grad_() for x in part.inputs()]
            force, moment = model.chain(part.with_inputs(inputs), values).loads.unbind(-1)
            by_force = torch.autograd.grad(force.sum(), inputs, retain_graph=True, materialize_grads=True)
            by_moment = torch.autograd.grad(moment.sum(), inputs, materialize_grads=True)
        each = torch.stack([torch.stack(by_force, -1), torch.stack(by_moment, -1)], dim=1)
        if whole is not None:
            each = torch.cat([whole[start : start + BLOCK], each[:, :, 2:]], dim=2)
        yield each.nan_to_num(nan=0.0, posinf=0.0, neginf=0.0)


def relative_error(squares: Tensor, counts: Tensor) -> float:
    """The paper's E of squared errors (N, 2), in units of the largest loads, of those that count (N, 2) bool.

    >>> relative_error(torch.tensor([[9.0, 0.0], [9.0, 16.0]]), torch.tensor([[True, False], [True, True]]))
    5.0
    """
    return float((torch.where(counts, squares, 0.0).sum(0) / counts.sum(0).clamp_min(1)).sum().sqrt())


def noise_floor(variance: Tensor, present: Tensor, scale: Tensor) -> float:
    """The error E of a perfect model: variance (N, 2), of what is present (N, 2) bool; scale (2,)."""
    return relative_error(variance / scale**2, present)


@dataclass(frozen=True)
class Noise:
    """What the measuring does to N rows, as a fitted model and the scatter about it say.

    sensitivity: (N, 2, 2 + pressures), see `sensitivities`; informative: (N, 2) bool, see Readings.informative_mask."""

    rows: Rows
    accuracy: Accuracy
    sensitivity: Tensor
    informative: Tensor
    scatter: Scatter

    def whitener(self, doubt: Tensor | None = None, of: Tensor | None = None, even: bool = False) -> Whitener:
        """Of all rows, or of some, (n,) int64. doubt, even: as for a Whitener."""
        rows, scatter = self.rows, self.scatter
        sensitivity, informative = self.sensitivity, self.informative
        if of is not None:
            rows, scatter, sensitivity, informative = rows[of], scatter.of(of), sensitivity[of], informative[of]
        state, bed = torch.as_tensor(rows.state), rows.states.bed
        return Whitener(
            sensitivity, state, self.accuracy, scatter, bed, rows.readings.present, informative, doubt,
            clock_of(rows.states), even, rows.levels,
        )  # fmt: skip


def _found(own: Tensor, position: Tensor, present: Tensor, scatter: Scatter | None) -> tuple[Tensor, Tensor, Tensor]:
    """Variances (N, 2) and position errors (N, 2, 2) that were stated, as rows were found to scatter, and which of the
    readings that are present count."""
    if scatter is None:
        return own, position, present
    position = position * (scatter.position / scatter.state.sqrt())[:, None, None]
    return own / scatter.reading, position, present & (scatter.reading > LEAST)


class Whitener:
    """Turns loads' residuals into independent numbers of standard deviation one, if the noise is as stated.

    The noise of a row is its sensors', plus its pressure error seen through ∂(F, M)/∂P; the noise of a kinematic state
    is its rows', plus a position error (δl, δφ) that all its rows share, seen through ∂(F, M)/∂(l, φ). With L Lᵀ the
    covariance of a row, A = L⁻¹ ∂(F, M)/∂(l, φ) diag(σ_l, σ_φ), and V diag(w) Vᵀ = Σ AᵀA over a state's rows, the
    state's covariance is I + A Aᵀ in units of L, and its inverse root I − A V diag((1 − (1 + w)^−½)/w) Vᵀ Aᵀ.

    Where the scatter is known, every reading counts with its own precision: L is divided by its root, so that a reading
    that slipped becomes zero and takes no part in its state's position error. Where the model is known to be wrong by
    some amount in every reading, that adds to its variance: else digits that it cannot have would decide; where it is
    far off readings that did not slip weigh alike, see `Scatter.even`. Of errors with a memory, L takes off what a
    recording's earlier readings let expect, see `memory`.
    """

    def __init__(
        self,
        sensitivity: Tensor,
        state: Tensor,
        accuracy: Accuracy,
        scatter: Scatter | None = None,
        bed: Bed = KINEMATIC,
        present: Tensor | None = None,
        told: Tensor | None = None,
        doubt: Tensor | None = None,
        clock: Tensor | None = None,
        even: bool = False,
        levels: Levels | None = None,
    ) -> None:
        """sensitivity: (N, 2, 2 + pressures), see `sensitivities`. state: (N,) int64, number of each row's kinematic
        state. present: (N, 2) bool, readings that there are, all by default; of the others nothing is left, whatever
        they are said to be. told: (N, 2) bool, those that tell something of their state's position error, all by
        default: a push on a tube that hangs loose does not, see Readings.informative_mask. doubt: (2,) SI, standard
        deviation by which the model is wrong in every reading. clock: (N,) s, of a log, whose scatter may have a
        memory. even: see Scatter.even; for a model that is far off. levels: of the pressures, see there."""
        if present is None:
            measured = torch.tensor([q in bed.measured for q in bed.readings])
            present = measured.expand(len(state), 2)
        self.scatter, self.present = scatter, present
        self.told = present if told is None else present & told
        _, self.state = torch.unique(state, return_inverse=True)
        self.states = int(self.state.max()) + 1 if len(state) else 0
        # What one standard deviation of each pressure's readings does to the loads, (N, 2, pressures), and that [Pa].
        self.by_pressure, self.pressure_error = sensitivity[:, :, 2:] * accuracy.pressure, accuracy.pressure
        own, position = _parts(sensitivity, accuracy, bed, self.told)
        self.doubt, self.even = doubt, even
        # Variance of each load, (N, 2) N², (N·m)²: all of it, shared or not; zero where there is no reading.
        alike = _of_levels(sensitivity, levels)
        by_level = alike.square().sum(-1)
        self.variance = torch.where(present, own + position.square().sum(-1) + by_level, 0.0)
        weigh = scatter.even() if scatter is not None and even else scatter
        found = _found(own, position, present, scatter)
        # Variance of every reading as it was found to scatter, (N, 2); zero of readings that do not count.
        by_place = found[1].square().sum(-1).nan_to_num(0.0, 0.0, 0.0)
        self.scattered = torch.where(found[2], found[0] + by_place + by_level, 0.0)
        own, position, counts = _found(own, position, present, weigh) if even else found
        # A reading that does not count tells nothing of the other one of its row.
        both = torch.where(counts.all(-1), self.by_pressure.prod(1).sum(-1), 0.0)
        if weigh is not None:
            both = torch.where(counts.all(-1), both / weigh.reading.prod(-1).sqrt(), 0.0)
        # Standard deviation of each load, (N, 2), but for the position error that a state's rows share.
        self.own, self.counts = own.sqrt(), counts
        if doubt is not None:
            own = own + doubt**2
        force, moment = torch.where(counts, own, torch.inf).unbind(-1)
        slant = both / force.sqrt()
        self.force, self.moment = force.sqrt(), (moment - slant**2).sqrt()
        self.lean = slant / self.moment
        self.places = position
        self.filter: Filter | None = None
        if scatter is not None and scatter.memory is not None and clock is not None:
            self.filter = self._filter(scatter, own, counts, clock)
        self.shared = self._forget(self.apart(position))
        size, axes = torch.linalg.eigh(self.gathered(self.shared.transpose(1, 2) @ self.shared))
        size = size.clamp_min(0)
        share = torch.where(size > 1e-10, (1 - (1 + size).rsqrt()) / size.clamp_min(1e-10), 0.5)
        self.shrink = axes @ (share[:, :, None] * axes.transpose(1, 2))
        self._know(alike)

    def _know(self, alike: Tensor) -> None:
        """Takes note of what all rows of a level err by, (N, 2, levels)."""
        self.alike = alike
        self.of_levels = Shared.of(self._whole(alike).flatten(0, 1))

    @property
    def count(self) -> int:
        """How many readings tell something."""
        return int(self.told.sum())

    def floor(self, scale: Tensor) -> float:
        """The error E that the noise alone would make, with the readings' largest values (2,)."""
        return noise_floor(self.variance, self.present, scale)

    def found_floor(self, scale: Tensor) -> float:
        """The same of the noise as it was found."""
        return noise_floor(self.scattered, self.right, scale)

    @property
    def right(self) -> Tensor:
        """Readings that count and did not slip, (N, 2) bool."""
        return self.counts if self.slipped is None else self.counts & ~self.slipped

    @property
    def slipped(self) -> Tensor | None:
        """Readings that slipped, (N, 2) bool; None where nothing is known of that."""
        return None if self.scatter is None else self.scatter.slipped

    @property
    def expected(self) -> float:
        """What the noise alone makes of the sum of squares of whitened residuals: less than their number where the
        model is in doubt."""
        if self.doubt is None:
            return self.count
        noise = torch.where(self.told, self.scattered, 0.0)
        return float((noise / (noise + self.doubt**2)).sum())

    @property
    def efficiency(self) -> float:
        """Information of a whitened number, as a share of a normal one's: heavy tails hold less."""
        return self.scatter.tails.efficiency if self.scatter else 1.0

    def _filter(self, scatter: Scatter, own: Tensor, counts: Tensor, clock: Tensor) -> Filter:
        """What forgets errors in units of their own size. own: variance (N, 2) of all that a reading errs by itself."""
        assert scatter.memory is not None
        share = scatter.memory.share
        kept = torch.where(counts, share * self.own.square() / own, 0.0)
        return Filter(scatter.memory, kept * scatter.weight, 1 - kept, self.state, clock)

    def _forget(self, columns: Tensor) -> Tensor:
        return columns if self.filter is None else self.filter.innovations(columns)

    def part(self, rows: Tensor) -> Whitener:
        """The whitener of some rows (n,) int64 alone. Raises ValueError unless they are whole kinematic states."""
        if len(rows) == len(self.state) and bool((rows[1:] > rows[:-1]).all()):
            return self
        chosen, state = torch.unique(self.state[rows], return_inverse=True)
        if len(rows) != int(torch.isin(self.state, chosen).sum()):
            raise ValueError("a part to whiten must hold whole kinematic states")
        part = object.__new__(Whitener)
        part.state, part.states, part.shrink = state, len(chosen), self.shrink[chosen]
        part.force, part.moment = self.force[rows], self.moment[rows]
        part.lean, part.own, part.scatter = self.lean[rows], self.own[rows], self.scatter
        part.variance, part.shared = self.variance[rows], self.shared[rows]
        part.present, part.told, part.places = self.present[rows], self.told[rows], self.places[rows]
        part.scattered, part.even = self.scattered[rows], self.even
        part.by_pressure, part.pressure_error = self.by_pressure[rows], self.pressure_error
        part.doubt, part.counts = self.doubt, self.counts[rows]
        part.filter = None if self.filter is None else self.filter.part(rows)
        part._know(self.alike[rows])
        return part

    @torch.no_grad()
    def __call__(self, loads: Tensor) -> Tensor:
        """(N, 2) or (N, 2, k), in N and N·m → the same shape, whitened."""
        white = self._whole(loads if loads.ndim == 3 else loads[..., None])
        white = self.of_levels.apart(white.flatten(0, 1)).view(white.shape)
        return white if loads.ndim == 3 else white[..., 0]

    def _whole(self, columns: Tensor) -> Tensor:
        """The same (N, 2, k) where levels err by nothing."""
        white = self._forget(self.apart(columns))
        # Everything in place and element by element: products of many 2 × 2 matrices would cost three times as much.
        by_force, by_moment = self.shared[:, 0, :, None], self.shared[:, 1, :, None]
        common = white[:, :1] * by_force
        common.addcmul_(white[:, 1:], by_moment)
        common = (self.shrink @ self.gathered(common)).index_select(0, self.state)
        for j in range(2):
            white[:, 0].addcmul_(common[:, j], by_force[:, j], value=-1)
            white[:, 1].addcmul_(common[:, j], by_moment[:, j], value=-1)
        return white

    def apart(self, columns: Tensor) -> Tensor:
        """L⁻¹ times (N, 2, k): each row in units of its own errors, with the position error still in it."""
        rows = torch.empty(columns.shape, dtype=columns.dtype)
        torch.div(columns[:, 0], self.force[:, None], out=rows[:, 0])
        torch.div(columns[:, 1], self.moment[:, None], out=rows[:, 1])
        rows[:, 1].addcmul_(rows[:, 0], self.lean[:, None], value=-1)
        return rows

    def drawn(self, generator: torch.Generator) -> Tensor:
        """One draw of the noise, (N, 2) in N and N·m: of each reading, and of the place that a state's rows share. Zero
        for readings that do not count."""
        own = torch.randn(len(self.state), 2, generator=generator, dtype=torch.float64)
        place = torch.randn(self.states, self.shared.shape[2], generator=generator, dtype=torch.float64)
        if self.filter is not None:
            own = self.filter.colored(own)
        rows = torch.stack([own[:, 0] * self.force, (own[:, 1] + own[:, 0] * self.lean) * self.moment], dim=1)
        rows = rows + (self.places @ place[self.state][..., None])[..., 0]
        if self.alike.shape[2]:
            rows = rows + self.alike @ torch.randn(self.alike.shape[2], generator=generator, dtype=torch.float64)
        return torch.where(rows.isfinite(), rows, 0.0)

    def gathered(self, rows: Tensor) -> Tensor:
        """Sum over the rows of each state: (N, …) → (states, …)."""
        return torch.zeros(self.states, *rows.shape[1:], dtype=rows.dtype).index_add_(0, self.state, rows)


def _of_levels(sensitivity: Tensor, levels: Levels | None) -> Tensor:
    """What one standard deviation of each level's error does to the loads, (N, 2, levels)."""
    if levels is None:
        return sensitivity.new_zeros(len(sensitivity), 2, 0)
    each = []
    for group, error, slope in zip(
        levels.group.unbind(1), levels.error.unbind(1), sensitivity[:, :, 2:].unbind(2), strict=True
    ):
        _, number = torch.unique(group, return_inverse=True)
        of = torch.nn.functional.one_hot(number).to(slope.dtype)
        each.append((slope * error[:, None])[..., None] * of[:, None])
    found = torch.cat(each, dim=2)
    return found[:, :, (found != 0).any(0).any(0)]


def whitened_basis(basis: Tensor, whiten: Whitener) -> Tensor:
    """Basis (N, k) given to force and to moment in turn, whitened: (2N, 2k). Columns of length one before that."""
    force, moment = whiten.variance.sqrt().mean(0)
    return whiten(both_loads(basis * force, basis * moment)).flatten(0, 1)
