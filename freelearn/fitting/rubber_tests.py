"""The tests of a rubber as a fit sees them: stresses, and what a rubber with some values makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.specimen_schema import MODES, SHEAR, Stresses
from freelearn.data.specimen_tests import TIME, tests_of, timed
from freelearn.physics.chain.model import Values
from freelearn.physics.mechanics.energy import MPA
from freelearn.physics.models.rubber import Rubber, per_shear


@dataclass(frozen=True)
class Still:
    """A mode's stresses at rest [Pa] and the stretches along and across them, each (N,). sheared: in simple shear."""

    along: Tensor
    across: Tensor
    stress: Tensor
    sheared: bool

    @classmethod
    def from_rows(cls, rows: pd.DataFrame) -> Still:
        """Of the rows of one mode."""
        held = Stresses.from_table(rows)
        along, across = torch.tensor(held.along), torch.tensor(held.across)
        return cls(along, across, torch.tensor(held.stress_mpa) * MPA, bool((rows["mode"] == SHEAR).all()))

    @property
    def largest(self) -> Tensor:
        """Largest |P|, ()."""
        return self.stress.abs().max()

    def misfit(self, rubber: Rubber, values: Values) -> Tensor:
        """(P̂ − P)/P_max, (N,)."""
        stress = rubber.stress(values, self.along, self.across)
        stress = stress * per_shear(self.along) if self.sheared else stress
        return (stress - self.stress) / self.largest

    def neighbors(self, misfit: Tensor) -> float:
        """Sum of products of neighbors' misfits: none where rows have no order in time."""
        return 0.0


@dataclass(frozen=True)
class Recorded:
    """One direction of recordings, M samples in all, one recording after the other: stretches along and across the
    stresses [Pa], (M,) each, NaN where none was measured. sheared: (M,) bool. scale: the largest |P| of each sample's
    recording, of both directions, (M,) Pa."""

    along: Tensor
    across: Tensor
    measured: Tensor
    sheared: Tensor
    scale: Tensor
    recording: Recording[Tensor]

    @classmethod
    def from_tests(cls, tests: Sequence[pd.DataFrame], second: bool = False) -> Recorded:
        """Of the rows of some recordings. second: direction 2."""
        rows = pd.concat(tests, ignore_index=True)
        run = np.repeat(np.arange(len(tests)), [len(test) for test in tests])
        names = ["stretch", "stretch_2", "stress_mpa"] if not second else ["stretch_2", "stretch", "stress_2_mpa"]
        along, across, stress, time = (torch.tensor(rows[n].to_numpy(np.float64)) for n in (*names, TIME))
        largest = [float(test[["stress_mpa", "stress_2_mpa"]].abs().max().max()) for test in tests]
        scale = torch.tensor(largest, dtype=torch.float64)[run] * MPA
        sheared = torch.tensor((rows["mode"] == SHEAR).to_numpy())
        return cls(along, across, stress * MPA, sheared, scale, Recording(along, torch.tensor(run), time))

    @property
    def there(self) -> Tensor:
        """Where a stress was measured, (M,) bool."""
        return ~self.measured.isnan()

    @property
    def stress(self) -> Tensor:
        """What was measured, (n,) Pa."""
        return self.measured[self.there]

    @property
    def largest(self) -> Tensor:
        """Largest |P| of what was measured in the same recording, (n,)."""
        return self.scale[self.there]

    def predicted(self, rubber: Rubber, values: Values) -> Tensor:
        """P̂ of every sample, (M,) Pa."""
        return rubber.relaxing(values, self.along, self.across, self.sheared, self.recording)

    def misfit(self, rubber: Rubber, values: Values) -> Tensor:
        """(P̂ − P)/P_max, (n,)."""
        return ((self.predicted(rubber, values) - self.measured) / self.scale)[self.there]

    def neighbors(self, misfit: Tensor) -> float:
        """As in Still, of samples that follow each other in one recording."""
        run = self.recording.run[self.there]
        return float((misfit[1:] * misfit[:-1])[run[1:] == run[:-1]].sum())


Part = Still | Recorded


def parts_of(table: pd.DataFrame) -> Mapping[str, Sequence[Part]]:
    """What each test of a table (of read_specimens) consists of, by name: modes in their usual order, then recordings,
    one part for each direction that was measured."""
    tests = tests_of(table)
    still: dict[str, Sequence[Part]] = {mode: [Still.from_rows(tests[mode])] for mode in MODES if mode in tests}
    return still | {name: _recorded([rows]) for name, rows in tests.items() if timed(rows).any()}


def together(table: pd.DataFrame, names: Sequence[str]) -> list[Part]:
    """Some of the tests: all recordings as one, so that their samples go through one scan."""
    tests = tests_of(table)
    still: list[Part] = [Still.from_rows(tests[name]) for name in names if not timed(tests[name]).any()]
    recordings = [tests[name] for name in names if timed(tests[name]).any()]
    return still + (_recorded(recordings) if recordings else [])


def _recorded(tests: Sequence[pd.DataFrame]) -> list[Part]:
    both = [Recorded.from_tests(tests, second) for second in (False, True)]
    return [part for part in both if part.there.any()]
