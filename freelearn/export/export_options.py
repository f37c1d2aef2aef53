"""What an export is asked for, and the packages that it needs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from freelearn.common.errors import UserError, unknown

# By the ending of their file.
FORMATS = {"onnx": ".onnx", "c": ".c", "fmu": ".fmu", "mujoco": ".xml", "table": ".nc"}
# Error of a table, as a share of the range, unless another is asked for; and what none can be finer than.
ERROR, FINEST = 1e-3, 1e-6
IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")


@dataclass(frozen=True)
class Options:
    """to: one of FORMATS. name: of the actuator, as code may name it. sample: of a run with several. force: whether to
    export what the data do not determine. license: of the data, in words.
    error: of a table, a share of the range."""

    to: str
    name: str = "actuator"
    sample: int | None = None
    force: bool = False
    license: str | None = None
    error: float = ERROR

    def __post_init__(self) -> None:
        if self.to not in FORMATS:
            raise unknown("format of export:", self.to, FORMATS)
        if not IDENTIFIER.fullmatch(self.name):
            raise UserError(f"name={self.name} cannot name code: choose letters, digits and _, a letter first.")
        if not FINEST <= self.error <= 0.5:
            raise UserError(f"error={self.error:g} is not possible for a table: choose a share of {FINEST:g} … 0.5.")


def asked_for(path: str | Path, to: str | None = None) -> tuple[Path, str, str]:
    """Folder, format and name of the actuator that a path asks for: a file's by its ending, or a folder with `to`.
    Raises UserError.

    >>> asked_for("arm/left.onnx")
    (PosixPath('arm'), 'onnx', 'left')
    >>> asked_for("c")
    (PosixPath('.'), 'c', 'actuator')
    """
    path = Path(path)
    told = {ending: name for name, ending in FORMATS.items()}.get(path.suffix.lower())
    if told is not None:
        if to not in (None, told):
            raise UserError(
                f"{path.name} is no file of to={to}: name a folder, or a file that ends in {FORMATS.get(str(to), '?')}."
            )
        return path.parent, told, re.sub(r"\W", "_", path.stem)
    if to is None and str(path) in FORMATS:
        return Path(), str(path), "actuator"
    if to is None:
        raise UserError(
            f"{path} does not say the format: add to={'|'.join(FORMATS)}, or name a file, such as {path}/muscle.c."
        )
    return path, to, "actuator"


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
