"""Answers to a log with blanks: what to impose along its recordings for the readings wished."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, ELONGATION, PRESSURE, Bed, Quantity
from freelearn.data.columns import Columns
from freelearn.data.logs import run_numbers
from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.log_derivatives import by_inputs, log_jacobian, shifted
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.queries.answers import columns_of
from freelearn.queries.inverse.asker import Answered, Asker
from freelearn.queries.inverse.blanks import patterns
from freelearn.queries.inverse.compromise import BANDED, UNREACHABLE
from freelearn.queries.inverse.log_bands import Sources, log_deviations
from freelearn.queries.inverse.miss import Miss
from freelearn.queries.inverse.system import System, sizes
from freelearn.queries.inverse.trajectory import Wish, pursued

# A miss below this share of the largest reading is none.
MET = 1e-3
GAP = "nothing is wished here: it goes on smoothly"
NEAREST = "no value within what was gone through gives it: the nearest makes"


@dataclass(frozen=True)
class LogQuestion:
    """A log with blanks.

    table: complete but for these, which are NaN. bed: of the run: what is imposed, and what is read. system: its rows,
    each by itself. scale: the largest of each reading, (2,) SI.
    """

    table: pd.DataFrame
    bed: Bed
    system: System
    scale: Tensor

    def answered(self, asker: Asker, x: Tensor, y: Tensor) -> Answered:
        """Fills the blanks, NaN, of the system's inputs x (N, m) and outputs y (N, 2).

        The search begins at what each row would answer by itself."""
        alone = replace(asker, banded=False).answered(self.system, x, y)
        wish = self._wish(asker)
        inputs = pursued(wish, self._begin(alone), self._shown, self._slopes)
        with torch.no_grad():
            found = self.system.model(self._states(inputs))
        return self._told(asker, alone, wish, inputs, found, x, y)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Of what is imposed, (m,)."""
        return Columns(self.bed, len(self.system.states.members)).imposed

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is imposed, (m,)."""
        return (*self.bed.state, *[PRESSURE] * self.system.pressures)

    @property
    def placed(self) -> bool:
        """Whether the bed reads what the system takes for its inputs."""
        return self.bed is DEAD_LOAD and self.system.mechanical

    @cached_property
    def recordings(self) -> list[Tensor]:
        """The rows of each."""
        run = torch.as_tensor(run_numbers(self.table))
        return [torch.nonzero(run == number)[:, 0] for number in range(int(run.max()) + 1)]

    def _wish(self, asker: Asker) -> Wish:
        """What is asked for, in the bed's quantities."""
        blank = torch.tensor(self.table[list(self.columns)].isna().to_numpy())
        shown = [self.table[q.column].to_numpy(np.float64) * q.factor for q in self.bed.readings]
        wanted = torch.as_tensor(np.stack(shown, axis=1))
        low, high = (edge.clone() for edge in asker.span.box(self.system))
        room = ((asker.span.looked[1] - asker.span.looked[0]) * sizes(self.system).amax(0)).clamp_min(1e-12)
        if self.placed:
            # A load that is asked for may be any.
            low[:, :2], high[:, :2], room[:2] = -torch.inf, torch.inf, asker.scale
        asking = [rows for rows in self.recordings if bool(blank[rows].any()) and _told_by(blank[rows], wanted[rows])]
        return Wish(blank, wanted, low, high, room, self.scale, asking)

    def _begin(self, alone: Answered) -> Tensor:
        """Inputs of the bed (N, m), SI: those given, and what each row would answer by itself; where it has none, a
        straight line between those that have."""
        answered = {column.name: column.value for column in columns_of(self.system, alone)}
        begin = []
        for name, quantity in zip(self.columns, self.quantities, strict=True):
            value = self.table[name].fillna(pd.Series(answered[name])).to_numpy(np.float64).copy()
            for rows in map(Tensor.numpy, self.recordings):
                there = rows[np.isfinite(value[rows])]
                value[rows] = np.interp(rows, there, value[there]) if len(there) else 0.0
            begin.append(torch.as_tensor(value * quantity.factor) + self._rest(quantity))
        return torch.stack(begin, dim=-1)

    def _rest(self, quantity: Quantity) -> Tensor | float:
        """What an input is beyond its column."""
        return self.system.states.reference_length if quantity is ELONGATION else 0.0

    def _states(self, inputs: Tensor) -> States:
        """The rows at inputs of the bed (N, m), with what they remember."""
        each = zip(self.columns, self.quantities, inputs.unbind(-1), strict=True)
        filled = self.table.assign(**{name: ((x - self._rest(q)) / q.factor).numpy() for name, q, x in each})
        if self.system.states.members:
            filled["pressure_kpa"] = filled[list(self.columns[2:])].mean(axis=1)
        return States.from_table(filled)

    def _shown(self, inputs: Tensor) -> tuple[States, Tensor]:
        states = self._states(inputs)
        with torch.no_grad():
            return states, self.system.model(states).loads

    def _slopes(self, recording: Recording[States], samples: Tensor, quantity: int) -> Tensor:
        return by_inputs(self.system.model, recording, self.system.values, samples, quantity)

    def _told(
        self, asker: Asker, alone: Answered, wish: Wish, inputs: Tensor, found: Prediction, x: Tensor, y: Tensor
    ) -> Answered:
        """Inputs of the bed and its readings there as answers, with what is to be said of them."""
        own = torch.zeros(len(x), dtype=torch.bool)
        own[torch.cat([*wish.recordings, *(rows for rows in self.recordings if not bool(wish.blank[rows].any()))])] = (
            True
        )
        at, outputs = inputs, found.loads
        if self.placed:
            place = found.loads + torch.stack([self.system.states.reference_length, 0 * x[:, 0]], dim=-1)
            at, outputs = torch.cat([place, inputs[:, 2:]], dim=-1), inputs[:, :2]
        status, why = self._words(wish, found, own, alone)
        lost = torch.tensor([word not in BANDED and word != UNREACHABLE for word in status])
        at = torch.where(x.isnan(), torch.where(lost[:, None], torch.nan, at), x)
        outputs = torch.where(y.isnan(), torch.where(lost[:, None], torch.nan, outputs), y)
        answered = replace(
            alone,
            x=at,
            y=outputs,
            solutions=torch.tensor([int(word == "ok") for word in status]),
            status=status,
            extrapolated=asker.span.outside(self.system, at, asker.slack(self.system)).any(-1),
            why=why,
            every=alone.every[alone.every.row < 0],
        )
        if not asker.banded or asker.miss is None:
            return answered
        half_x, half_y = self._half_widths(asker.miss, asker, answered, wish, inputs, x, y)
        return replace(answered, x_half=half_x, y_half=half_y)

    def _words(self, wish: Wish, found: Prediction, own: Tensor, alone: Answered) -> tuple[list[str], list[str]]:
        """Status of each row, and why. own: rows of recordings that can be answered, (N,) bool."""
        missed = ((found.loads - wish.wanted) / wish.scale).abs().nan_to_num(nan=0.0) > MET
        asked, wished = wish.blank.sum(1), torch.isfinite(wish.wanted).sum(1)
        status, why = list(alone.status), list(alone.why)
        for row in torch.nonzero(own)[:, 0].tolist():
            status[row], why[row] = Status(int(found.status[row])).name.lower(), ""
            if status[row] == "ok" and bool(missed[row].any()):
                made = [
                    f"{q.column} {float(found.loads[row, i]) / q.factor:.4g}"
                    for i, q in enumerate(self.bed.readings)
                    if bool(missed[row, i])
                ]
                status[row], why[row] = UNREACHABLE, f"{NEAREST} {' and '.join(made)}"
            elif asked[row] and not wished[row]:
                why[row] = GAP
        return status, why

    def _half_widths(
        self, miss: Miss, asker: Asker, answered: Answered, wish: Wish, inputs: Tensor, x: Tensor, y: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Half of the 95 % bands of inputs (N, m) and outputs (N, 2). Of places that hang, those of a state that lasts;
        else each answer knows what was not known of the samples before it."""
        half_x, half_y = torch.full_like(x, torch.nan), torch.full_like(y, torch.nan)
        told = torch.tensor([status in BANDED for status in answered.status])
        along = None if self.placed else self._deviations(miss, wish, inputs)
        for pattern in patterns(self.system, x, y):
            rows = pattern.rows[told[pattern.rows]]
            if pattern.why or not len(rows):
                continue
            if along is None or not pattern.asked:
                system, at = self.system[rows], answered.x[rows]
                _, slopes = system.slopes(at)
                wide, tall = miss.half_width(system, at, slopes, pattern.asked, pattern.given, asker.scale)
            else:
                factor = miss.factors(pattern.asked, pattern.given, asker.scale)
                wide = along[0][rows][:, list(pattern.asked)] * factor[: len(pattern.asked)]
                tall = along[1][rows] * factor[len(pattern.asked) :]
            for i, column in enumerate(pattern.asked):
                half_x[rows, column] = wide[:, i]
            for column in pattern.blank:
                half_y[rows, column] = tall[:, column]
        return half_x, half_y

    def _deviations(self, miss: Miss, wish: Wish, inputs: Tensor) -> tuple[Tensor, Tensor]:
        """Standard deviations of the inputs (N, m) and readings (N, 2) of a new measurement along the log."""
        model, states, parameters = self.system.model, self._states(inputs), miss.parameters
        shared, covariance = [log_jacobian(model, states, model.vector().detach())], [parameters.matrix]
        own, white = torch.zeros(inputs.shape[1], dtype=inputs.dtype), miss.beyond
        if miss.accuracy is not None:
            own, read = (
                torch.tensor([getattr(miss.accuracy, q.error) for q in of], dtype=inputs.dtype)
                for of in (self.quantities, self.bed.readings)
            )
            # A place is set once for a recording, and what no accuracy accounts for goes on along it; pressures and
            # readings err at each sample.
            same = torch.eye(2, dtype=inputs.dtype).expand(len(inputs), 2, 2)
            shared += [shifted(model, states, self.system.values), same]
            covariance += [torch.diag(own[:2] ** 2), miss.beyond]
            own, white = torch.where(torch.arange(len(own)) < 2, 0.0, own), torch.diag(read**2)
        sources = Sources(torch.cat(shared, dim=-1).nan_to_num(nan=0.0), torch.block_diag(*covariance), white)
        found, made = log_deviations(wish, states, inputs, self._slopes, sources)
        lost = (shared[0][:, :, parameters.undetermined] != 0).any(-1)
        found = torch.where(lost.any(-1, keepdim=True), torch.nan, (found**2 + own**2).sqrt())
        return found, torch.where(lost, torch.nan, made)


def _told_by(blank: Tensor, wanted: Tensor) -> bool:
    """Whether a recording wishes for enough: blank (n, m) bool, wanted (n, 2). Of several pressures the least are
    taken."""
    asked = blank.any(0)
    needed = int(asked[:2].sum()) + int(asked[2:].any())
    return needed <= int(torch.isfinite(wanted).sum(1).max())
