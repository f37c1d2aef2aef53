"""A fitted model for other software: the files of one format, and their certificate."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from freelearn.errors import UserError
from freelearn.export.actuator import Actuator
from freelearn.export.c_file import write_c
from freelearn.export.certificate import Certificate, certificate
from freelearn.export.extras import needed
from freelearn.export.fmu_file import write_fmu
from freelearn.export.mujoco_file import write_mujoco
from freelearn.export.onnx_file import write_onnx
from freelearn.export.options import Options
from freelearn.export.page import write_page
from freelearn.export.refusal import doubts
from freelearn.export.round_trip import Samples, compared
from freelearn.export.table_file import write_table
from freelearn.export.written import Written
from freelearn.results.fitted_model import FittedModel

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
    actuator = Actuator.of(fitted, options.sample)
    folder.mkdir(parents=True, exist_ok=True)
    written = WRITERS[options.to](actuator, folder, options)
    difference = compared(actuator, written.answers, Samples.of(actuator)) if written.answers else None
    found = certificate(actuator, folder, options, written, difference, wrong)
    write_page(actuator, found)
    return found
