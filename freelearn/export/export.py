"""A fitted model for other software: which runs are exported, the files of one format, and their certificate."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from freelearn.common.errors import UserError
from freelearn.export.actuator import Actuator
from freelearn.export.certificate import Certificate, certificate
from freelearn.export.certificate_page import write_page
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import Samples, Written, compared
from freelearn.export.writers.c_file import write_c
from freelearn.export.writers.fmu_file import write_fmu
from freelearn.export.writers.mujoco_file import write_mujoco
from freelearn.export.writers.onnx_file import write_onnx
from freelearn.export.writers.table_file import write_table
from freelearn.queries.fitted_model import FittedModel
from freelearn.records.estimates import Estimate


def doubts(fitted: FittedModel) -> list[str]:
    """Why the model should not be relied on elsewhere, a sentence each; none where it may."""
    found, content = [], fitted.run.content
    if content.get("verdict") == "undecided":
        found.append("The verdict of the run is undecided: the table cannot tell what the actuator is.")
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


# A fitted model for other software: the files of one format, and their certificate.

Writer = Callable[[Actuator, Path, Options], Written]
WRITERS: dict[str, Writer] = {
    "c": write_c,
    "onnx": write_onnx,
    "fmu": write_fmu,
    "mujoco": write_mujoco,
    "table": write_table,
}


def export(fitted: FittedModel, folder: Path, options: Options) -> Certificate:
    """Writes the actuator to the folder, runs what was written beside the model itself, and certifies it.

    Raises UserError: for a run that the data do not determine, unless forced; for what a format cannot hold; for a
    package that is missing.
    """
    wrong = doubts(fitted)
    if wrong and not options.force:
        raise UserError(f"{wrong[0]} Such a model is not exported; force=true does, and its certificate says so.")
    needed(options.to)
    actuator = Actuator.from_fitted(fitted, options.sample)
    folder.mkdir(parents=True, exist_ok=True)
    written = WRITERS[options.to](actuator, folder, options)
    difference = compared(actuator, written.answers, Samples.from_actuator(actuator)) if written.answers else None
    found = certificate(actuator, folder, options, written, difference, wrong)
    write_page(actuator, found)
    return found
