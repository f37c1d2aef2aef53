"""A model without and with its effects, on kinematic states that neither fit has seen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from freelearn.api.tasks.run import scored_rows
from freelearn.measurements.error import common, set_error
from freelearn.measurements.rows import Rows
from freelearn.measurements.sets import split_rows
from freelearn.models.prediction import Status
from freelearn.render.tensorboard.run import log_run
from freelearn.results.comparison import Compared
from freelearn.results.run import Run

# Where each fit keeps its TensorBoard curves, beside those of the run itself.
WITHOUT, WITH = "without_effects", "with_effects"


def compare(one: Callable[[bool, Path], Run], folder: Path) -> dict[str, Compared]:
    """E of each test set without and with effects: whole kinematic states that neither fit saw, rows that both answer.

    one: with effects?, folder → the run. Both leave their TensorBoard curves in `folder`, in folders of their own, so
    that they show over each other.
    """
    runs: dict[str, Run] = {}
    for name, effects in ((WITHOUT, False), (WITH, True)):
        runs[name] = one(effects, folder / name)
        log_run(runs[name], folder / name)
    return compared(runs[WITHOUT], runs[WITH])


def can_hold_out(table: pd.DataFrame, name: str, seed: int, shares: tuple[float, float]) -> bool:
    """Whether whole kinematic states of a named set are held out by a split of these shares."""
    labels = split_rows(table, seed, True, shares)
    return len(scored_rows(table["sample"].to_numpy(), labels, name)) > 0


def compared(without: Run, with_effects: Run) -> dict[str, Compared]:
    """Errors of two runs over the same table and split, each test set scored on the rows that both answer."""
    measured, sample = Rows.from_table(without.table), without.table["sample"].to_numpy()
    both = common(*(run.prediction.status == Status.OK for run in (without, with_effects)))
    pairs = {}
    for name in without.errors:
        pick = scored_rows(sample, without.labels, name)
        errors = [set_error(measured[pick], run.prediction.loads[pick], both[pick]) for run in (without, with_effects)]
        pairs[name] = Compared(errors[0].E, errors[1].E, errors[0].n)
    return pairs
