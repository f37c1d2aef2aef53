"""A fitted model for other software: which runs are exported, the files of one format, and their certificate."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from freelearn.common.errors import UserError, cannot_write
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.certificate import CERTIFICATE, Certificate, certificate
from freelearn.export.certificate_page import write_page
from freelearn.export.checks import checked
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import Written
from freelearn.export.writers.c_file import write_c
from freelearn.export.writers.fmu_file import write_fmu
from freelearn.export.writers.mujoco_file import write_mujoco
from freelearn.export.writers.onnx_file import write_onnx
from freelearn.export.writers.table_file import write_table
from freelearn.queries.fitted_model import FittedModel
from freelearn.records.estimates import Estimate

# Verdicts that promise nothing elsewhere, and why.
REFUSED = {
    "undecided": "the table cannot tell what the actuator is",
    "unexplained": "something systematic is left that the model does not account for",
}


def doubts(fitted: FittedModel) -> list[str]:
    """Why the model should not be relied on elsewhere, a sentence each; none where it may."""
    found, content = [], fitted.run.content
    if (verdict := content.get("verdict")) in REFUSED:
        found.append(f"The verdict of the run is {verdict}: {REFUSED[verdict]}.")
    variance, declared = np.diagonal(fitted.covariance), list(fitted.model.declared.items())
    entries = content.get("parameters") or {}
    untold = {n for n, entry in entries.items() if Estimate.from_plain(n, entry).untold}
    lost = [
        name
        for (name, p), v in zip(declared, variance, strict=True)
        if not p.fixed and (name in untold or not np.isfinite(v))
    ]
    if lost:
        nothing = len(lost) == len(declared)
        which = "Nothing was fitted to the data, or nothing of it is known" if nothing else "The data do not determine"
        found.append(f"{which}: {', '.join(lost)}." if nothing else f"{which} {', '.join(lost)}.")
    return found


Writer = Callable[[Functions, Path, Options], Written]
WRITERS: dict[str, Writer] = {
    "c": write_c,
    "onnx": write_onnx,
    "fmu": write_fmu,
    "mujoco": write_mujoco,
    "table": write_table,
}


def export(fitted: FittedModel, folder: Path, options: Options) -> Certificate:
    """Writes the actuator to the folder, runs what was written beside the model itself, and certifies it.

    All files are made in a folder inside it and moved at the end: what fails leaves nothing. Raises UserError for a run
    that the data do not determine, unless forced; for what a format cannot hold; for a package that is missing; for a
    folder that holds another export.
    """
    wrong = doubts(fitted)
    if wrong and not options.force:
        raise UserError(f"{wrong[0]} Such a model is not exported; force=true does, and its certificate says so.")
    needed(options.to)
    _free(folder, options)
    functions = Functions(Actuator.from_fitted(fitted, options.sample))
    with _beside(folder) as place:
        written = WRITERS[options.to](functions, place, options)
        checks = checked(functions, written) if written.answers else None
        found = certificate(functions, place, options, written, checks, wrong)
        write_page(functions, found)
        _moved(place, folder)
    return replace(found, folder=folder)


def _free(folder: Path, options: Options) -> None:
    """Raises UserError where a certificate of something else lies: one folder holds one export."""
    try:
        there = json.loads((folder / CERTIFICATE).read_text(encoding="utf-8"))
        name, to = there["name"], there["to"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    if (name, to) != (options.name, options.to):
        raise UserError(
            f"{folder} holds the export of {name} to={to} and its certificate: choose another folder for "
            f"{options.name} to={options.to}."
        )


@contextmanager
def _beside(folder: Path) -> Iterator[Path]:
    """A folder in another, for as long as something is made in it. Raises UserError where nothing can be written."""
    there = folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".export.", dir=folder) as place:
            yield Path(place)
    except (OSError, UserError) as problem:
        # Nobody knows the folder that things are made in: it is the one asked for that is told.
        cause = problem if isinstance(problem, OSError) else problem.__cause__
        if not isinstance(cause, OSError):
            raise
        raise cannot_write(folder, cause, "choose another folder, or make room") from problem
    finally:
        if not there:
            # Not empty where the export was written.
            with suppress(OSError):
                folder.rmdir()


def _moved(place: Path, folder: Path) -> None:
    """The certificate goes first and comes last: where it lies the export is whole."""
    (folder / CERTIFICATE).unlink(missing_ok=True)
    moved: list[Path] = []
    try:
        for path in sorted(place.iterdir(), key=lambda path: path.name == CERTIFICATE):
            os.replace(path, folder / path.name)
            moved.append(folder / path.name)
    except OSError:
        for path in moved:
            path.unlink(missing_ok=True)
        raise
