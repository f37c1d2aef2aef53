"""What an export answers along recordings beside the fitted model: it runs freely from the first sample to the last."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import DEAD_LOAD, ELONGATION, TWIST
from freelearn.data.logs import RUN, TIME, run_numbers
from freelearn.data.states import States
from freelearn.export.actuator import WORST, Actuator
from freelearn.export.arithmetic.function import Function
from freelearn.export.log_step import GIVEN, usual_step
from freelearn.physics.chain.prediction import Prediction, Status

# Random recordings and samples of each; of the run's own recordings the samples of one that are followed, and of all.
RANDOM, SAMPLES = 40, 100
LONGEST, OWN = 1000, 6000
# Steps of time of random recordings, in units of the usual one, and how long a rest is, which one sample of so many is.
STEPS, REST, RESTS = (0.6, 3.0), 20.0, 25
# Random inputs go on straight lines from place to place, each of at most so many samples.
LINE = 12


@dataclass(frozen=True)
class Followed:
    """A recording to be followed. inputs (n, k): what is imposed, SI. dt (n,): since the last sample, s. begin (s,):
    the state before the first sample."""

    inputs: np.ndarray
    dt: np.ndarray
    begin: np.ndarray

    def __len__(self) -> int:
        return len(self.inputs)


# What each sample of recordings is answered with: (n, outputs) of each.
Follow = Callable[[Sequence[Followed]], list[np.ndarray]]
# One sample: inputs (k,), dt, state (s,) → outputs (m,) and the next state.
OneSample = Callable[[np.ndarray, float, np.ndarray], tuple[np.ndarray, np.ndarray]]


def each_followed(sample: OneSample) -> Follow:
    """By a function of one sample."""

    def follow(recordings: Sequence[Followed]) -> list[np.ndarray]:
        found = []
        for recording in recordings:
            state, out = recording.begin.copy(), []
            for x, dt in zip(recording.inputs, recording.dt, strict=True):
                answer, state = sample(x, float(dt), state)
                out.append(answer)
            found.append(np.array(out))
        return found

    return follow


@dataclass(frozen=True)
class Along:
    """Recordings of an actuator, the run's own and random ones, and what `predict` says of them."""

    actuator: Actuator
    step: Function

    @cached_property
    def _own_table(self) -> pd.DataFrame:
        """The run's, its recordings by number."""
        own = self.actuator.fitted.run.table
        own = own.assign(**{RUN: run_numbers(own)})
        if self.actuator.bed is DEAD_LOAD:
            # Where it hung nobody knows beforehand.
            own = own.assign(**{q.column: 0.0 for q in (ELONGATION, TWIST)})
        return own

    @cached_property
    def table(self) -> pd.DataFrame:
        """The run's table, and random recordings of the actuator behind it, within the data."""
        generator = np.random.default_rng(0)
        return self._with(self._own_table, [(self._drawn(generator), self._times(generator)) for _ in range(RANDOM)])

    def _with(self, own: pd.DataFrame, recordings: Sequence[tuple[np.ndarray, np.ndarray]]) -> pd.DataFrame:
        """A table with recordings of the actuator behind it: what is imposed (n, k), SI, and times (n,) s of each."""
        actuator, begin, every = self.actuator, float(own[TIME].max()) + 1.0, [own]
        row, first = own.iloc[[self._own_rows(own)[0]]], int(own[RUN].max()) + 1
        names, quantities = actuator.fitted.columns.imposed, actuator.system.inputs
        for number, (x, times) in enumerate(recordings):
            columns = {n: v / q.factor for n, q, v in zip(names, quantities, x.T, strict=True)}
            if actuator.states.members:
                columns["pressure_kpa"] = np.mean([columns[n] for n in names[2:]], axis=0)
            time = {TIME: begin + times - times[0], RUN: first + number, "step": 0}
            every.append(pd.concat([row] * len(x), ignore_index=True).assign(**columns, **time))
            begin = float(every[-1][TIME].iloc[-1]) + 1.0
        return pd.concat(every, ignore_index=True)

    def said(self, x: np.ndarray, times: np.ndarray) -> np.ndarray:
        """What `predict` says of a recording of its own: inputs (n, k) SI at times (n,) s → (n, outputs)."""
        table = self._with(self._own_table, [(x, times)])
        with torch.no_grad():
            loads: torch.Tensor = self.actuator.fitted.model(States.from_table(table)).loads
        answered: np.ndarray = loads[-len(x) :, self.actuator.shown].numpy()
        return answered

    def _own_rows(self, table: pd.DataFrame) -> np.ndarray:
        actuator = self.actuator
        own = np.ones(len(table), dtype=bool) if actuator.states.members else table["sample"] == actuator.sample
        return np.flatnonzero(own)

    def _drawn(self, generator: np.random.Generator) -> np.ndarray:
        """What is imposed, SI: straight lines from place to place within the data, now and then of one sample."""
        found = []
        for low, high in self.actuator.domain:
            places = np.r_[0, np.cumsum(generator.integers(1, LINE, size=SAMPLES))]
            found.append(np.interp(np.arange(SAMPLES), places, generator.uniform(low, high, size=len(places))))
        return np.stack(found, axis=1)

    def _times(self, generator: np.random.Generator) -> np.ndarray:
        """Of its samples, s."""
        steps = np.exp(generator.uniform(np.log(STEPS[0]), np.log(STEPS[1]), size=SAMPLES))
        rests = generator.random(SAMPLES) < 1 / RESTS
        times: np.ndarray = usual_step(self.actuator) * np.cumsum(np.where(rests, REST, steps))
        return times

    @cached_property
    def states(self) -> States:
        """Of the table's rows."""
        return States.from_table(self.table)

    @cached_property
    def predicted(self) -> Prediction:
        """What `predict` says of the table's rows."""
        with torch.no_grad():
            found: Prediction = self.actuator.fitted.model(self.states)
        return found

    @cached_property
    def rows(self) -> list[np.ndarray]:
        """Of each recording that is followed."""
        run, own = self.table[RUN].to_numpy(), self._own_rows(self.table)
        left, rows = OWN, list[np.ndarray]()
        random = int(self.table[RUN].max()) + 1 - RANDOM
        for number in np.unique(run[own]):
            some = own[run[own] == number]
            if number < random:
                some = some[: min(left, LONGEST)]
                left -= len(some)
            if len(some):
                rows.append(some)
        return rows

    @cached_property
    def x(self) -> torch.Tensor:
        """Inputs of the equations, (N, m)."""
        return torch.stack(self.states.inputs(), dim=-1)

    @cached_property
    def recordings(self) -> list[Followed]:
        """The same, to be followed."""
        inputs = (self.x - self.actuator.rest).numpy()
        recording = self.states.recording
        assert recording is not None
        step = recording.step.numpy()
        return [Followed(inputs[rows], step[rows], self._begin(int(rows[0]))) for rows in self.rows]

    def _begin(self, row: int) -> np.ndarray:
        """The state before a recording's first row: what a whole recording remembers of those before it."""
        begin = np.zeros(len(self.step.state))
        for i, port in enumerate(self.step.state):
            name = port.name
            if not any(name.startswith(given) for given in GIVEN):
                continue
            states = self.states
            if name.startswith(WORST):
                if states.members:
                    states = states.members[int(name.rsplit("_", 1)[1]) - 1]
                name = "past_severity"
            begin[i] = float(getattr(states, name)[row])
        return begin

    @cached_property
    def wanted(self) -> list[dict[str, np.ndarray]]:
        """By output, what each recording is to be answered with."""
        loads, status = self.predicted
        inside = self.actuator.reaches(self.x, loads)
        found = {p.name: loads[:, k].numpy() for p, k in zip(self.actuator.answered, self.actuator.shown, strict=True)}
        found |= {"status": status.double().numpy(), "inside": inside.double().numpy()}
        return [{name: value[rows] for name, value in found.items()} for rows in self.rows]

    @cached_property
    def reached(self) -> list[np.ndarray]:
        """Samples of each recording before which all had an equilibrium, (n,) bool: after one without what is carried
        hangs on where its search gave up."""
        none = [np.r_[False, w["status"][:-1] == int(Status.NO_EQUILIBRIUM)] for w in self.wanted]
        return [~np.logical_or.accumulate(n) for n in none]

    @cached_property
    def settled(self) -> list[np.ndarray]:
        """Those of them that have one, (n,) bool."""
        pairs = zip(self.reached, self.wanted, strict=True)
        return [reached & (w["status"] != int(Status.NO_EQUILIBRIUM)) for reached, w in pairs]
