"""An actuator as an FMU (FMI 2.0 co-simulation) with its source inside."""

from __future__ import annotations

import hashlib
import platform
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from freelearn.common.errors import UserError
from freelearn.common.files import write_whole
from freelearn.common.package import VERSION
from freelearn.export.actuator_functions import Functions
from freelearn.export.along import Followed
from freelearn.export.arithmetic.function import Function
from freelearn.export.export_options import Options, needed
from freelearn.export.round_trip import Answers, Written
from freelearn.export.writers.c_file import compiled, title
from freelearn.export.writers.c_source import c_source
from freelearn.export.writers.fmu_source import description, wrapper

OUTSIDE = (
    "Output `inside` = 0 beyond the data that the model was fitted on, output `status` says where there is no "
    "equilibrium; the numbers are what the model itself would say there."
)
# The folder and the ending of binaries, by the machine.
BINARIES = {"linux": ("linux64", ".so"), "darwin": ("darwin64", ".dylib"), "win32": ("win64", ".dll")}
# A file's bytes shall not hang on the day.
DAY = (2020, 1, 1, 0, 0, 0)


def write_fmu(functions: Functions, folder: Path, options: Options) -> Written:
    """NAME.fmu, and one more for each other question. Raises UserError where its source cannot be compiled here."""
    needed("fmu")
    about = title(functions, options)
    paths = {e: _written(folder, f"{options.name}{e}", about, f) for e, f in functions.files.items()}

    def of(f: Function) -> Answers:
        path, names = paths[functions.file_of(f)], [p.name for p in f.outputs]
        return lambda x: answered(path, x, names)

    where = f"{platform.system()} {platform.machine()}"
    notes = [f"Compiled for {where}; other machines compile what is in sources/."]
    answers = {f.name: of(f) for f in functions.every if not f.carried}
    step = functions.step
    if step:
        notes.append(
            "A step of the co-simulation is one sample of the log: what is imposed goes on a straight line from the "
            "last inputs to those that are set before it; the first sample is where the initialization ends."
        )
    follow = partial(followed, paths[""], step) if step else None
    return Written(list(paths.values()), answers, OUTSIDE, notes=notes, follow=follow)


def _written(folder: Path, name: str, about: str, f: Function) -> Path:
    """NAME.fmu of one function."""
    from fmpy.validation import validate_fmu

    f = f if f.carried else replace(f, name="forward")
    source = c_source(name, about, [f])
    guid = "{" + hashlib.sha256(source.encode()).hexdigest()[:32] + "}"
    source += wrapper(name, guid, f)
    where, ending = BINARIES.get(sys.platform, BINARIES["linux"])
    with tempfile.TemporaryDirectory() as place:
        written, library = Path(place) / f"{name}_fmu.c", Path(place) / f"{name}{ending}"
        written.write_text(source, encoding="utf-8")
        if problem := compiled([written], library, "-fvisibility=default"):
            raise UserError(f"An FMU needs a C compiler on this machine ({problem}): install gcc, or use to=c.")
        parts = {
            "modelDescription.xml": description(name, about, guid, VERSION, f).encode(),
            f"sources/{name}_fmu.c": source.encode(),
            f"binaries/{where}/{library.name}": library.read_bytes(),
        }
    path = folder / f"{name}.fmu"
    write_whole(path, lambda beside: _zipped(beside, parts))
    if problems := validate_fmu(str(path)):
        raise UserError(f"FMPy refuses {path.name}: {problems[0]}")
    return path


def _zipped(path: Path, parts: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(zipfile.ZipInfo(name, DAY), content, zipfile.ZIP_DEFLATED)


@contextmanager
def opened(path: Path) -> Iterator[tuple[Any, dict[str, int]]]:
    """An instance of it in FMPy, and the references of its variables."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    about: Any = fmpy.read_model_description(str(path))
    with tempfile.TemporaryDirectory() as place:
        fmpy.extract(str(path), place)
        fmu = FMU2Slave(
            guid=about.guid,
            unzipDirectory=place,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName="one",
        )
        fmu.instantiate()
        yield fmu, {v.name: v.valueReference for v in about.modelVariables}
        fmu.terminate()
        fmu.freeInstance()


def answered(path: Path, inputs: np.ndarray, names: list[str]) -> np.ndarray:
    """Outputs of these names (n, m) at inputs (n, k), by FMPy: a step of the co-simulation each."""
    with opened(path) as (fmu, reference):
        given = list(range(inputs.shape[1]))
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        out = []
        for i, row in enumerate(inputs):
            fmu.setReal(given, row.tolist())
            fmu.doStep(currentCommunicationPoint=float(i), communicationStepSize=1.0)
            out.append(fmu.getReal([reference[n] for n in names]))
    return np.array(out)


def followed(path: Path, f: Function, recordings: Sequence[Followed]) -> list[np.ndarray]:
    """Recordings one after the other, by FMPy: a step of the co-simulation from each sample to the next."""
    found = []
    with opened(path) as (fmu, reference):
        given = [reference[p.name] for p in f.given[:-1]]
        state, outputs = ([reference[p.name] for p in some] for some in (f.state, f.answered))
        for recording in recordings:
            fmu.reset()
            fmu.setReal(state, recording.begin.tolist())
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
            fmu.setReal(given, recording.inputs[0].tolist())
            fmu.exitInitializationMode()
            out, time = [fmu.getReal(outputs)], 0.0
            for x, dt in zip(recording.inputs[1:].tolist(), recording.dt[1:].tolist(), strict=True):
                fmu.setReal(given, x)
                fmu.doStep(currentCommunicationPoint=time, communicationStepSize=dt)
                out.append(fmu.getReal(outputs))
                time += dt
            found.append(np.array(out))
    return found
