"""Packages that only exports need, and the line that installs one that is missing."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from freelearn.errors import UserError

# Importing them is left to who needs them: an actuator in C needs none.
NEEDS = {
    "c": (),
    "onnx": ("onnx", "onnxruntime"),
    "fmu": ("fmpy",),
    "mujoco": ("mujoco",),
    "table": ("xarray", "h5netcdf", "h5py"),
}


def needed(to: str) -> dict[str, Any]:
    """The modules that writing and checking an export takes, by name. Raises UserError for one that is missing."""
    try:
        return {name: import_module(name) for name in NEEDS[to]}
    except ImportError as problem:
        raise UserError(
            f"to={to} needs {problem.name}, which is not installed: pip install 'freelearn[export]'."
        ) from None


def versions(to: str) -> dict[str, str]:
    """Versions of what wrote and checked an export."""
    found = {}
    for name in ("freelearn", "torch", "numpy", *NEEDS[to]):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
