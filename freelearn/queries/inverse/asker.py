"""Answers to rows with blanks: every solution that there is, and the one that an actuator would take."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Rows
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.blanks import Pattern, patterns
from freelearn.queries.inverse.cells_between_nodes import starts
from freelearn.queries.inverse.choice import chosen
from freelearn.queries.inverse.compromise import BANDED, UNANSWERED, Compromise, Found, direct, taken
from freelearn.queries.inverse.miss import Miss
from freelearn.queries.inverse.nodes import Grid
from freelearn.queries.inverse.roots import Equations, Roots, different
from freelearn.queries.inverse.system import Span, System


@dataclass(frozen=True)
class Answered:
    """Answers of N rows, SI.

    x (N, m), y (N, 2): inputs and outputs with every blank filled, NaN where there is no answer. x_half, y_half: half
    of the 95 % band of what was filled, NaN elsewhere. solutions (N,): how many were found within the span looked
    through. status: of each row. extrapolated (N,) bool: beyond what was measured. why: a few words, "" where there is
    nothing to say. every: all solutions of rows with several."""

    x: Tensor
    y: Tensor
    x_half: Tensor
    y_half: Tensor
    solutions: Tensor
    status: list[str]
    extrapolated: Tensor
    why: list[str]
    every: Roots


# Starts nearer to each other than this many cells are one: with more, two answers in neighboring cells may be lost.
ONE_START = 0.7


@dataclass(frozen=True)
class Asker(Compromise):
    """Answers questions of a fitted model. banded: whether answers have bands; what is answered does not depend on
    that."""

    banded: bool = True

    @classmethod
    def from_model(cls, model: Model, rows: Rows, miss: Miss | None) -> Asker:
        """Of a model that was fitted on rows."""
        with torch.no_grad():
            system = System.placed(model, rows.states, model(rows.states).loads)
        shown = system.at(system.x)
        size = shown.loads[shown.status == Status.OK].abs().nan_to_num(0.0)
        largest = size.amax(0).clamp_min(1e-9) if len(size) else torch.ones(2, dtype=torch.float64)
        return cls(Span.from_system(system), largest, miss, rows.states.bed is DEAD_LOAD)

    def answered(self, system: System, x: Tensor, y: Tensor) -> Answered:
        """Fills the blanks, NaN, of inputs x (N, m) and outputs y (N, 2)."""
        out = Answered(
            x.clone(),
            y.clone(),
            torch.full_like(x, torch.nan),
            torch.full_like(y, torch.nan),
            torch.zeros(len(x), dtype=torch.int64),
            [UNANSWERED] * len(x),
            torch.zeros(len(x), dtype=torch.bool),
            [""] * len(x),
            Roots.none(x.shape[1]),
        )
        every = []
        for pattern in patterns(system, x, y):
            if pattern.why:
                for row in pattern.rows.tolist():
                    out.why[row] = pattern.why
                continue
            every.append(self._fill(system[pattern.rows], pattern, out))
        return replace(out, every=Roots.joined(every)) if every else out

    def _fill(self, system: System, pattern: Pattern, out: Answered) -> Roots:
        """Answers the rows of one pattern, and gives all solutions of rows with several."""
        rows = pattern.rows
        found = self._found(system, pattern, out.x[rows], out.y[rows])
        out.x[rows] = found.x
        blank = list(pattern.blank)
        filled = out.y[rows]
        filled[:, blank] = found.outputs[:, blank]
        out.y[rows] = filled
        out.solutions[rows] = found.count
        for row, status, why in zip(rows.tolist(), found.status, found.why, strict=True):
            out.status[row], out.why[row] = status, why
        slack = self.slack(system)
        out.extrapolated[rows] = self.span.outside(system, found.x, slack).any(-1)
        if self.banded and self.miss is not None:
            half_x, half_y = self.miss.half_width(
                system, found.x, found.slopes, pattern.asked, pattern.given, self.scale
            )
            # A band is that of an answer: around the nearest to one there is none.
            none = torch.tensor([status not in BANDED for status in found.status])
            half_x[none], half_y[none] = torch.nan, torch.nan
            asked = list(pattern.asked)
            wide = out.x_half[rows]
            wide[:, asked] = half_x
            out.x_half[rows] = wide
            wide = out.y_half[rows]
            wide[:, blank] = half_y[:, blank]
            out.y_half[rows] = wide
        several = found.every
        return replace(several, row=rows[several.row])

    def slack(self, system: System) -> Tensor:
        """What an input may lie beyond those measured by their accuracy alone, (m,)."""
        accuracy = self.miss.accuracy if self.miss else None
        if accuracy is None:
            return torch.full((len(system.inputs),), 1e-9, dtype=torch.float64)
        return torch.tensor([3 * getattr(accuracy, q.error) + 1e-9 for q in system.inputs], dtype=torch.float64)

    def _found(self, system: System, pattern: Pattern, x: Tensor, y: Tensor) -> Found:
        if not pattern.asked:
            return direct(system, x)
        if not pattern.square:
            return self.agreed(system, pattern, x, y)
        grid = Grid(system, x, pattern.asked, pattern.given, self.span)
        some = self._roots(grid, pattern, y)
        shaky = _without(some[some.stable], len(x))
        if len(shaky):
            # Where the loads bend sharply, or end, the corners of a cell do not tell all.
            some = self._with(some, self._roots(grid, pattern, y, shaky), grid)
        lost = _without(some, len(x))
        if len(lost) and not grid.exact:
            # What a table does not resolve the model itself may.
            own = Grid(system[lost], x[lost], pattern.asked, pattern.given, self.span, always_exact=True)
            more = self._roots(own, pattern, y[lost], torch.arange(len(lost)))
            some = self._with(some, replace(more, row=lost[more.row]), grid)
            lost = _without(some, len(x))
        found = taken(some, *chosen(self.span, system, pattern, x, y, some), x)
        return self.reached(system, pattern, x, y, found, lost) if len(lost) else found

    @staticmethod
    def _with(some: Roots, more: Roots, grid: Grid) -> Roots:
        """Both, each once."""
        both = Roots.joined([some, more])
        return both[different(both.row, both.x[:, list(grid.asked)] / grid.size[both.row])]

    def _roots(self, grid: Grid, pattern: Pattern, y: Tensor, thorough: Tensor | None = None) -> Roots:
        """All roots within the span looked through, of all rows; or of some (n,), from more starts."""
        asked, given = list(pattern.asked), list(pattern.given)
        wanted, rows, begin = y[:, given], [], []
        for part, nodes in grid.parts(thorough):
            row, place = starts(nodes, wanted[part], thorough is not None)
            start = grid.x[part[row]]
            start[:, asked] = place
            rows.append(part[row])
            begin.append(start)
        row, start = torch.cat(rows), torch.cat(begin)
        # Neighboring cells tell of one place.
        once = different(row, start[:, asked] / grid.size[row], ONE_START)
        low, high = (edge[:, asked] for edge in self.span.box(grid.system))
        equations = Equations(grid.system, asked, given, wanted, grid.size, (low, high))
        some = equations.roots(row[once], start[once], pattern.free(grid.system, self.hung))
        room = 1e-6 * (high - low)
        at = some.x[:, asked]
        return some[((at >= (low - room)[some.row]) & (at <= (high + room)[some.row])).all(-1)]


def _without(some: Roots, count: int) -> Tensor:
    """Rows of so many that have no root, (n,) int64."""
    there = torch.zeros(count, dtype=torch.bool)
    there[some.row] = True
    return torch.nonzero(~there)[:, 0]
