"""A fitted model as two equations between what is imposed and what is answered, and where answers are looked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from freelearn.data.beds import ELONGATION, FORCE, KINEMATIC, MOMENT, PRESSURE, Bed, Quantity
from freelearn.data.columns import Columns
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Prediction
from freelearn.physics.chain.row_derivatives import rows_jacobian

# Rows that are worked on at once: with a few derivatives for each, more than in a fit.
BLOCK = 32_768


@dataclass(frozen=True)
class System:
    """y = f(x), row by row: x (N, m) the inputs of N states, y (N, 2) their outputs, SI.

    Of a model of loads x is length, twist and each actuator's pressure, and y force and moment, whatever bed it was
    fitted on; a network that was fitted under a dead load takes the loads, and gives elongation and twist.
    states: whose own inputs do not matter. bed: which says what the inputs and outputs are.
    """

    model: Model
    states: States

    @classmethod
    def from_model(cls, model: Model, states: States) -> System:
        """The equations of a model at the designs, and with the memory, of some states."""
        direct = model.family == "mlp"
        return cls(model, states if direct else states.replace(bed=KINEMATIC))

    @classmethod
    def placed(cls, model: Model, states: States, shown: Tensor) -> System:
        """The same, with states whose own inputs are where the actuators are. shown: (N, 2) SI, what the bed shows,
        measured or predicted: under a dead load it is the place."""
        direct = model.family == "mlp"
        return cls.from_model(model, states if direct else Rows.whole(states, shown).as_loads.states)

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, rows: Tensor | slice) -> System:
        return System(self.model, self.states[rows])

    def repeated(self, count: int) -> System:
        """The first row's states so many times over."""
        return System(self.model, self.states[torch.zeros(count, dtype=torch.int64)])

    @property
    def bed(self) -> Bed:
        """Says what the equations' inputs and outputs are."""
        return self.states.bed

    @property
    def mechanical(self) -> bool:
        """Whether the outputs are the loads at a place, so that their derivative is a stiffness."""
        return self.bed.readings == (FORCE, MOMENT)

    @property
    def inputs(self) -> tuple[Quantity, ...]:
        """The quantity of each input, (m)."""
        return (*self.bed.state, *[PRESSURE] * self.pressures)

    @property
    def columns(self) -> tuple[str, ...]:
        """The column of each input and output in a measurement table, (m + 2)."""
        imposed = Columns(self.bed, len(self.states.members)).imposed
        return (*imposed, *(quantity.column for quantity in self.bed.readings))

    @property
    def x(self) -> Tensor:
        """The states' own inputs, (N, m)."""
        return torch.stack(self.states.inputs(), dim=-1)

    @property
    def pressures(self) -> int:
        """How many actuators have a pressure."""
        return len(self.states.members) or 1

    @cached_property
    def values(self) -> dict[str, Tensor]:
        """The model's values, cut from every derivative."""
        return {name: value.detach() for name, value in self.model.values().items()}

    def recorded(self, x: Tensor, values: dict[str, Tensor]) -> Prediction:
        """Outputs (N, 2) at inputs (N, m) of all rows at once, as whoever records them wants them. values: the
        model's, SI."""
        return self.model.chain(self.states.with_inputs(x.unbind(-1)), values)

    def recorded_slopes(self, x: Tensor, values: dict[str, Tensor]) -> tuple[Tensor, Tensor]:
        """The same outputs, and their derivatives (N, 2, m)."""
        return rows_jacobian(lambda inputs: self.recorded(inputs, values).loads, x)

    def at(self, x: Tensor) -> Prediction:
        """Outputs (N, 2) at inputs (N, m), and whether they mean anything, (N,)."""
        with torch.no_grad():
            parts = [self[rows].recorded(x[rows], self.values) for rows in _blocks(x)]
        return Prediction(torch.cat([p.loads for p in parts]), torch.cat([p.status for p in parts]))

    def slopes(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Outputs (N, 2) at inputs (N, m), and their derivatives (N, 2, m)."""
        parts = [self[rows].recorded_slopes(x[rows], self.values) for rows in _blocks(x)]
        return torch.cat([p[0] for p in parts]), torch.cat([p[1] for p in parts])

    def by_parameters(self, x: Tensor) -> Tensor:
        """Derivatives of the outputs by the model's raw vector at inputs (N, m): (N, 2, p)."""
        vector = self.model.vector().detach()
        parts = []
        for rows in _blocks(x):
            states = self.states[rows].with_inputs(x[rows].unbind(-1))
            copies = vector.expand(len(states), -1).clone().requires_grad_()
            with torch.enable_grad():
                y = self.model.chain(states, self.model.physical(copies)).loads
                each = [torch.autograd.grad(y[:, i].sum(), copies, retain_graph=True)[0] for i in (0, 1)]
            parts.append(torch.stack(each, dim=1))
        return torch.cat(parts)


def _blocks(x: Tensor) -> list[slice]:
    """Rows that are worked on at once; at least one block, so that there is something to join."""
    return [slice(start, start + BLOCK) for start in range(0, max(len(x), 1), BLOCK)]


# Where answers are looked for, and where they are extrapolated.

# Beyond what was measured an answer is looked for this far, as a share of what was gone through.
BEYOND = 0.5
# At least so much of the reference length, and so much twist [rad], is looked through on either side of rest.
LEAST_LENGTH, LEAST_TWIST = 0.1, 0.5
# As a share of the pressures gone through.
PUMP = 0.05


@dataclass(frozen=True)
class Span:
    """Least and largest value of each input, (m,): lengths in reference lengths, the others SI.

    measured: of the rows that were fitted. looked: where an answer is looked for."""

    measured: tuple[Tensor, Tensor]
    looked: tuple[Tensor, Tensor]

    @classmethod
    def from_system(cls, system: System) -> Span:
        """From the states that a model was fitted on."""
        x = relative(system, system.x)
        low, high = x.amin(0), x.amax(0)
        lower, upper = low.clone(), high.clone()
        for i, quantity in enumerate(system.inputs):
            room = BEYOND * (high[i] - low[i])
            if quantity is PRESSURE:
                # A pump gives hardly more than it gave, and a valve no less than what is outside: as far off as errors
                # of measuring may make an answer.
                slack = PUMP * (high[i] - low[i])
                lower[i], upper[i] = torch.clamp(low[i], max=0.0) - slack, high[i] + slack
                continue
            rest, least = (1.0, LEAST_LENGTH) if quantity is ELONGATION else (0.0, LEAST_TWIST)
            if quantity.field in ("force", "moment"):
                rest, least = 0.0, 0.0
            lower[i] = min(float(low[i] - room), rest - least)
            upper[i] = max(float(high[i] + room), rest + least)
        return cls((low, high), (lower, upper))

    def box(self, system: System) -> tuple[Tensor, Tensor]:
        """Where an answer is looked for in each row, (N, m) twice, SI."""
        size = sizes(system)
        return self.looked[0] * size, self.looked[1] * size

    def outside(self, system: System, x: Tensor, slack: Tensor) -> Tensor:
        """Inputs (N, m) beyond what was measured by more than a slack (m,) in SI: (N, m) bool."""
        size = sizes(system)
        return (x < self.measured[0] * size - slack) | (x > self.measured[1] * size + slack)


def sizes(system: System) -> Tensor:
    """What each input counts in, (N, m): the reference length for a length, one for the others."""
    states: States = system.states
    ones = torch.ones_like(states.reference_length)
    return torch.stack([states.reference_length if q is ELONGATION else ones for q in system.inputs], dim=-1)


def relative(system: System, x: Tensor) -> Tensor:
    """Inputs with lengths in reference lengths, (N, m)."""
    return x / sizes(system)
