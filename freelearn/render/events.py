"""TensorBoard's event file: one in a folder, whoever writes to it. Errors are percent in all of them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from freelearn.files import write_whole

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
