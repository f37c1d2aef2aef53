"""C that is compiled on this machine, to be checked and timed."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from freelearn.export.function import Function

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
