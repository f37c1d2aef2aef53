"""`doctor`: what is installed, on which machine, and what is optional and absent."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from freelearn.commands.clean import size_of, spelled
from freelearn.package import CONF, VERSION

NEEDED = ("torch", "lightning", "hydra-core", "numpy", "pandas", "scipy", "matplotlib", "bokeh")
# Package → what it is for and the extra that installs it.
OPTIONAL = {
    "panel": ("the page of freelearn workbench", "workbench"),
    "openpyxl": ("raw files that are Excel workbooks", "excel"),
    "odfpy": ("raw files that are OpenDocument sheets (.ods)", "raw"),
    "h5py": ("raw files that are HDF5 or MATLAB -v7.3", "raw"),
    "pyarrow": ("raw files that are Parquet", "raw"),
    "onnx": ("freelearn export to=onnx", "export"),
    "hydra-joblib-launcher": ("sweeps on several cores", "joblib"),
    "hydra-submitit-launcher": ("sweeps on a SLURM cluster", "slurm"),
}
VARIABLES = ("FREELEARN_EFFECTS", "FREELEARN_MODELS", "FREELEARN_CORES", "FREELEARN_LARGEST_FILE_GB", "OMP_NUM_THREADS")


def main() -> None:
    """Prints it."""
    if sys.argv[1:]:
        asked = sys.argv[1] in ("--help", "-h")
        told = "usage: freelearn doctor\nWhat is installed, on which machine, and what is optional and absent."
        if not asked:
            sys.exit(f"error: doctor takes no words.\n{told}")
        print(told)
        return
    for title, lines in report().items():
        print(title)
        for name, said in lines:
            print(f"  {name:<26}{said}")


def report() -> dict[str, list[tuple[str, str]]]:
    """Lines (name, what is said of it) by title."""
    return {
        "freelearn": [("version", VERSION), ("python", platform.python_version()), ("configuration", str(CONF))],
        "packages": [(name, installed(name) or "missing: pip install freelearn again") for name in NEEDED],
        "optional": [(name, _optional(name)) for name in OPTIONAL],
        "devices": [("cores", str(os.cpu_count())), *_devices()],
        "variables": [(name, os.environ[name]) for name in VARIABLES if name in os.environ] or [("none set", "")],
        "disk": [("free here", spelled(shutil.disk_usage(Path.cwd()).free)), ("outputs", _outputs())],
    }


def installed(name: str) -> str:
    """The version of a package, "" where it is absent."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _optional(name: str) -> str:
    what, extra = OPTIONAL[name]
    return installed(name) or f"absent; {what}: pip install 'freelearn[{extra}]'"


def _devices() -> list[tuple[str, str]]:
    # Torch takes seconds to import, and may be what is broken.
    try:
        import torch
    except ImportError as problem:
        return [("torch", f"cannot be loaded: {problem}")]
    if not torch.cuda.is_available():
        return [("cuda", "none: device=cpu")]
    return [(f"cuda:{i}", torch.cuda.get_device_name(i)) for i in range(torch.cuda.device_count())]


def _outputs() -> str:
    folder = Path("outputs")
    return f"{spelled(size_of(folder))} in {folder.resolve()} (freelearn clean)" if folder.is_dir() else "none here"
