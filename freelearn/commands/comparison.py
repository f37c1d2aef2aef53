"""A model without and with its effects, on kinematic states that neither fit has seen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from freelearn.measurements.error import set_error
from freelearn.measurements.sets import TEST, samples_of
from freelearn.measurements.states import measured_loads
from freelearn.models.prediction import Status
from freelearn.render.tensorboard.run import log_run
from freelearn.results.run import Run

# Where each fit keeps its TensorBoard curves, beside those of the run itself.
WITHOUT, WITH = "without_effects", "with_effects"


def compare(one: Callable[[bool, Path], Run], folder: Path) -> dict[str, dict[str, float]]:
    """E of each test set {without, with} effects, whole kinematic states held out, over the rows that both answer.

    one: with effects?, folder → the run. Both leave their TensorBoard curves in `folder`, in folders of their own, so
    that they show over each other.
    """
    runs: dict[str, Run] = {}
    for name, effects in ((WITHOUT, False), (WITH, True)):
        runs[name] = one(effects, folder / name)
        log_run(runs[name], folder / name)
    both = (runs[WITHOUT].prediction.status == Status.OK) & (runs[WITH].prediction.status == Status.OK)
    first = runs[WITHOUT]
    loads, sample = measured_loads(first.table), first.table["sample"].to_numpy()
    found = {}
    for test in first.errors:
        inside = np.isin(sample, samples_of(test, sample)) & (first.labels == TEST)
        rows = torch.as_tensor(np.flatnonzero(inside))
        errors = [set_error(loads[rows], runs[n].prediction.loads[rows], both[rows]).E for n in (WITHOUT, WITH)]
        found[test] = dict(zip(("without", "with"), errors, strict=True))
    return found
