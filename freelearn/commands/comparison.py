"""A model without and with its effects, on kinematic states that neither fit has seen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from freelearn.fit.fit import FitOptions
from freelearn.fit.store import FitStore
from freelearn.models.base import Model
from freelearn.results.run import Run, run

# Where the run without effects keeps its TensorBoard curves, beside those of the run itself.
WITHOUT, WITH = "without_effects", "with_effects"


def compare(
    build: Callable[[bool], Model],
    table: pd.DataFrame,
    train: str,
    test: str,
    options: FitOptions,
    seed: int,
    folder: Path,
    store: FitStore | None,
) -> dict[str, dict[str, float]]:
    """E of each test set {without, with} effects, whole kinematic states held out. build: with effects? → model.

    Both fits leave their TensorBoard curves in `folder`, in folders of their own, so that they show over each other.
    """
    runs: dict[str, Run] = {}
    for name, effects in ((WITHOUT, False), (WITH, True)):
        inside = folder / name
        runs[name] = run(build(effects), table, train, test, options, seed, True, inside, None, store)
        from freelearn.render.tensorboard.run import log_run

        log_run(runs[name], inside)
    return {
        name: {"without": error.E, "with": runs[WITH].errors[name].E} for name, error in runs[WITHOUT].errors.items()
    }
