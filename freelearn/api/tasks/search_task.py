"""What a search is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import torch

from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.known import known_of, own_values
from freelearn.api.tasks.tables import LoadedTable
from freelearn.inference.candidate import Candidate
from freelearn.inference.question import Question
from freelearn.inference.testable import unclocked
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.members import members_in
from freelearn.measurements.rows import Rows
from freelearn.measurements.usable import usable_rows
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.known import Known


@dataclass(frozen=True)
class Task:
    """What a search is about. everything: the whole table's rows, buckled and left-out ones included, which belong to
    a state and to what it remembers. place: of the rows looked at, among them. library: effects to try; untestable:
    entries of discovery.json for the others."""

    settings: DiscoverSettings
    loaded: LoadedTable
    everything: Rows
    place: np.ndarray
    library: list[str]
    untestable: list[Candidate]
    device: str

    @property
    def rows(self) -> Rows:
        """The rows looked at."""
        return self.everything[torch.as_tensor(self.place)]

    @property
    def table(self) -> pd.DataFrame:
        """The rows looked at, in the measurement table's columns."""
        return self.loaded.table.iloc[self.place].reset_index(drop=True)

    @property
    def usable(self) -> Rows:
        """Every row of the table that is neither buckled nor left out."""
        return self.everything[torch.as_tensor(np.flatnonzero(usable_rows(self.loaded.table)))]

    def build(self, effects: Sequence[str]) -> Model:
        """A fresh model with these effects."""
        present = np.unique(self.loaded.table["sample"].to_numpy()[self.place])
        samples = [int(n) for n in present] if self.settings.per_sample else []
        members = len(members_in(self.loaded.table.columns)) if self.settings.per_sample else 0
        return build_model(self.settings.model.name, own_values(self.settings), effects, samples, members, self.known)

    @cached_property
    def known(self) -> Known:
        """What is known of the parameters beforehand."""
        return known_of(self.settings)

    def question(self, accuracy: Accuracy) -> Question:
        """What the search is asked."""
        settings = self.settings
        return Question(
            self.build, self.library, self.rows, accuracy, settings.seed, settings.effects,
            clocked=not unclocked(self.table.columns, self.rows),
        )  # fmt: skip
