"""An actuator as a C99 file, and C that is compiled on this machine, to be checked and timed."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.export.actuator_functions import Functions
from freelearn.export.along import OneSample, each_followed
from freelearn.export.arithmetic.function import Function
from freelearn.export.export_options import Options
from freelearn.export.round_trip import Answers, Written
from freelearn.export.writers.c_source import c_source

# As strict as a compiler gets; without the contraction of products and sums, so that every machine gives the same.
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
SECONDS = 600


def compiler() -> str | None:
    """The C compiler of this machine; None where there is none."""
    return next((found for name in ("gcc", "cc", "clang") if (found := shutil.which(name))), None)


def compiled(sources: Sequence[Path], library: Path, *more: str) -> str | None:
    """Compiles to a shared library. Returns what the compiler complains of, None where it does not."""
    found = compiler()
    if found is None:
        return "no C compiler on this machine"
    command = [found, *FLAGS, "-shared", "-fPIC", *more, "-o", str(library), *map(str, sources), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    return None if done.returncode == 0 else done.stderr.strip()[:2000]


class Library:
    """The functions of a compiled actuator."""

    def __init__(self, path: Path, name: str) -> None:
        self.name, self.loaded = name, ctypes.CDLL(str(path))

    def answers(self, f: Function, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (n, m) of a function at inputs (n, k), and what it returned, (n,) int."""
        call = self.loaded[f"{self.name}_{f.name}"]
        call.argtypes, call.restype = [ctypes.c_void_p, ctypes.c_void_p], ctypes.c_int
        rows = np.ascontiguousarray(inputs[:, : len(f.inputs)], dtype=np.float64)
        out = np.zeros((len(rows), len(f.outputs)))
        flags = np.zeros(len(rows), dtype=np.int64)
        start, step, end, wide = rows.ctypes.data, rows.strides[0], out.ctypes.data, out.strides[0]
        for i in range(len(rows)):
            flags[i] = call(start + i * step, end + i * wide)
        return out, flags

    def sample(self, f: Function) -> OneSample:
        """Of a function that carries a state: one sample of a recording."""
        call = self.loaded[f"{self.name}_{f.name}"]
        call.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
        call.restype, answered = ctypes.c_int, len(f.answered)

        def sample(x: np.ndarray, dt: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            given, after, out = np.ascontiguousarray(x), np.array(state), np.zeros(answered)
            call(given.ctypes.data, dt, after.ctypes.data, out.ctypes.data)
            return out, after

        return sample


# An actuator as a C99 file.

OUTSIDE = (
    "Bit 0 of what each function returns, and its output `inside` = 0; the numbers are what the model itself would say "
    "there. Bit 1: no equilibrium."
)


def write_c(functions: Functions, folder: Path, options: Options) -> Written:
    """NAME.c."""
    every = functions.every
    path = folder / f"{options.name}.c"
    write_text(path, c_source(options.name, title(functions, options), every))
    notes = [f"{f.name}: {f.operations} operations in every call" for f in every]
    if compiler() is None:
        return Written([path], {}, OUTSIDE, notes=[*notes, "No C compiler on this machine: the file was not run."])
    library = run(path, options.name)

    def answered(f: Function) -> Answers:
        return lambda x: library.answers(f, x)[0]

    follow = each_followed(library.sample(functions.step)) if functions.step else None
    answers = {f.name: answered(f) for f in every if not f.carried}
    return Written([path], answers, OUTSIDE, notes=notes, follow=follow)


def run(path: Path, name: str) -> Library:
    """The file compiled, with every warning an error. Raises UserError where the compiler refuses."""
    with tempfile.TemporaryDirectory() as place:
        library = Path(place) / f"{name}.so"
        if problem := compiled([path], library):
            raise UserError(f"The C compiler of this machine refuses {path.name}: {problem}")
        # Loaded, it stays when its file is gone.
        return Library(library, name)


def title(functions: Functions, options: Options) -> str:
    """The actuator in a line."""
    actuator = functions.actuator
    design = "an end block of several actuators" if actuator.states.members else f"sample {actuator.sample}"
    return f"{options.name}: {actuator.fitted.title}, {design}, written by freelearn"
