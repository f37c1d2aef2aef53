"""What a search is about, and the look at its table beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import torch

from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.loaded_table import LoadedTable
from freelearn.api.tasks.preparation import known_of, own_values
from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.beds import bed_of
from freelearn.data.columns import members_in, usable_rows
from freelearn.data.rows import Rows
from freelearn.discovery.checks.look import looked_over
from freelearn.discovery.checks.table_check import TableCheck
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.step import Candidate
from freelearn.discovery.search.testable import unclocked
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model


@dataclass(frozen=True)
class Task:
    """What a search is about. everything: the whole table's rows, buckled and left-out ones included, which belong to
    a state and to what it remembers. place: of the rows looked at, among them. library: effects to try; untestable:
    entries of discovery.json for the others; unshown: of these those that are tried, but never claimed, and what rows
    they need."""

    settings: DiscoverSettings
    loaded: LoadedTable
    everything: Rows
    place: np.ndarray
    library: list[str]
    untestable: list[Candidate]
    unshown: Mapping[str, str]
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
            clocked=not unclocked(self.table.columns, self.rows), unshown=self.unshown,
        )  # fmt: skip


CONTINUUM = "continuum"


def checked(task: Task) -> list[TableCheck]:
    """What an engineer would see in the rows that are looked at.

    The continuum model reads them, whichever is asked about, and without what is known of its parameters: what the
    table holds is looked at, not the model.
    """
    settings, table = task.settings, task.table
    given = [name for name in settings.effects if CONTINUUM in EFFECTS[name].families()]
    samples = [int(n) for n in np.unique(table["sample"])] if settings.per_sample else []
    members = len(members_in(table.columns)) if settings.per_sample else 0

    def build(effects: Sequence[str]) -> Model:
        return build_model(CONTINUUM, {}, effects, samples, members)

    stated = settings.data.accuracy
    return looked_over(table, build, given, PAPER if stated is None else stated.si(bed_of(table)), stated is not None)
