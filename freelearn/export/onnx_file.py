"""An actuator as ONNX files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from freelearn.export.actuator import Actuator
from freelearn.export.c_file import title
from freelearn.export.extras import needed
from freelearn.export.function import Function
from freelearn.export.onnx_model import onnx_model
from freelearn.export.options import Options
from freelearn.export.written import Written
from freelearn.files import write_bytes

OUTSIDE = (
    "Output `inside` = 0 beyond the data that the model was fitted on, output `status` says where there is no "
    "equilibrium; the numbers are what the model itself would say there."
)


def write_onnx(actuator: Actuator, folder: Path, options: Options) -> Written:
    """NAME.onnx with loads, derivatives, bands and flags, and NAME_pressure_for_….onnx."""
    needed("onnx")
    about, paths = title(actuator, options), []
    for f in (actuator.forward, *actuator.inverses):
        paths.append(folder / f"{options.name}{'' if f.name == 'forward' else '_' + f.name}.onnx")
        write_bytes(paths[-1], onnx_model(options.name, about, f).SerializeToString())
    session = opened(paths[0])
    return Written(paths, lambda x: answered(session, actuator.functions[0], x), OUTSIDE)


def opened(path: Path) -> Any:
    """The file in onnxruntime, on one core."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(path.read_bytes(), options, providers=["CPUExecutionProvider"])


def answered(session: Any, f: Function, inputs: np.ndarray) -> np.ndarray:
    """Outputs (n, m) of a function, by its ports' names, at inputs (n, k)."""
    given = {p.name: np.ascontiguousarray(inputs[:, i]) for i, p in enumerate(f.inputs)}
    found = session.run([p.name for p in f.outputs], given)
    return np.stack(found, axis=1)
