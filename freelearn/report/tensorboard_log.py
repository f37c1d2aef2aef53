"""A run in TensorBoard: its events, parameters and errors."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from freelearn.common.files import write_whole
from freelearn.records.provenance import Origin
from freelearn.records.run import Run
from freelearn.report.tables.lab_notes import run_story
from freelearn.report.tables.sweep_tables import scores

# TensorBoard's event file: one in a folder, whoever writes to it. Errors are percent in all of them.

NAMES = "events.out.tfevents.*"

# What the tab of custom scalars shows: of fits, of searches, and of sweeps.
Layout = dict[str, dict[str, list[str | list[str]]]]
_PARAMETERS: dict[str, list[str | list[str]]] = {"by step": ["Multiline", ["parameter/.*"]]}
FITTED: Layout = {
    "Error [%]": {
        "by iteration": ["Multiline", ["error_percent/train", "error_percent/validation"]],
        "on test sets": ["Multiline", ["test_error_percent/.*"]],
    },
    "Parameters (SI)": _PARAMETERS,
}  # fmt: skip
SEARCHED: Layout = {
    "Error by step of the search [%]": {
        "held out": ["Multiline", ["error_percent/held_out", "error_percent/fitted", "error_percent/noise_floor"]],
    },
    "Parameters (SI)": _PARAMETERS,
}  # fmt: skip
SWEPT: Layout = {
    "Error by training set [%]": {
        name.replace("_", " "): ["Multiline", [f"sweep_error_percent/{name}"]]
        for name in ("own_set", "unseen", "all_sets")
    }
}


@contextmanager
def event_file(folder: Path, go_on: bool = False) -> Iterator[SummaryWriter]:
    """A writer of the folder's only event file: all earlier ones are gone when it is done.

    go_on: with the events of the latest of them before its own; else it replaces them. Each writer of TensorBoard's
    begins a file of its own, and beside a later run's the curves of an earlier one would still be shown."""
    before = sorted(folder.glob(NAMES), key=lambda path: (path.stat().st_mtime_ns, path.name))
    with SummaryWriter(str(folder)) as writer:
        yield writer
    own = next(path for path in folder.glob(NAMES) if path not in before)
    if go_on and before:
        parts = (before[-1], own)

        # A file is a series of records, each whole in itself: one after the other they are a file again.
        def join(beside: Path) -> None:
            with open(beside, "wb") as whole:
                for part in parts:
                    with open(part, "rb") as file:
                        shutil.copyfileobj(file, whole)

        write_whole(own, join)
    for path in before:
        path.unlink(missing_ok=True)


# A run's numbers in TensorBoard: errors, and the hyperparameter table. Needs no matplotlib.


def log_run(run: Run, folder: Path, origin: Origin | None = None) -> None:
    """Writes errors by test set, hyperparameters and the run's story, after what the fit wrote; of a reused fit also
    the errors by iteration. What an earlier run left in the folder is replaced. origin: None for a part of a run, which
    has no story of its own."""
    wrote = bool(run.history) and not run.reused
    with event_file(folder, go_on=wrote) as writer:
        if run.reused:
            for epoch, train, validation in run.history:
                writer.add_scalar("error_percent/train", 100 * train, epoch)
                if run.model.needs_validation:
                    writer.add_scalar("error_percent/validation", 100 * validation, epoch)
        for name, error in run.errors.items():
            writer.add_scalar(f"test_error_percent/{name}", 100 * error.E, 0)
        # No more than five: TensorBoard's table hides what comes after these until it is ticked.
        settings: dict[str, str | int] = {
            "model": run.model.name,
            "train": run.train,
            "effects": ",".join(e.name for e in run.model.effects) or "none",
            "fit": run.method,
        }
        known = scores(run)._asdict().items()
        metrics = {f"error_percent/{name}": 100 * value for name, value in known if value is not None}
        if origin:
            settings["fit"] = f"{run.method}, split by {origin.split}"
            settings["seed"] = origin.seed
            writer.add_text("story", run_story(run, origin))
        writer.add_custom_scalars(FITTED)
        for name, value in metrics.items():
            writer.add_scalar(name, value, 0)
        # add_hparams would open a second event file in a folder of its own.
        file = writer._get_file_writer()
        # Nor is it declared with types.
        make: Any = hparams
        for summary in make(settings, metrics):
            file.add_summary(summary)
