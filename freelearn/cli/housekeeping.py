"""`clean` and `doctor`: old outputs, and what is installed on which machine."""

from __future__ import annotations

import argparse
import os
import platform
import re
import shutil
import sys
import time
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from freelearn.cli.command_line import exit_on_user_error
from freelearn.common.errors import UserError
from freelearn.common.package import CONF, VERSION

# `clean`: old outputs, their sizes told before any is deleted.

DAY = re.compile(r"\d{4}-\d{2}-\d{2}")
SECONDS = 86_400


@dataclass(frozen=True)
class Old:
    """A day's runs of one command: their folder, size [bytes] and age [days]."""

    folder: Path
    size: int
    age: float


def clean_main() -> None:
    """Lists what is old, asks, and deletes."""
    parser = argparse.ArgumentParser(
        prog="freelearn clean",
        description="Deletes the days of outputs/COMMAND/DAY that are old. Folders that you named yourself stay.",
    )
    parser.add_argument("outputs", nargs="?", type=Path, default=Path("outputs"), help="by default ./outputs")
    parser.add_argument("--older", type=float, default=30, metavar="DAYS", help="than so many days (30)")
    parser.add_argument("--yes", action="store_true", help="without asking")
    asked = parser.parse_args()
    with exit_on_user_error("interrupted; what was listed and is still there was not deleted."):
        clean(asked.outputs, asked.older, asked.yes)


def clean(outputs: Path, older: float, yes: bool = False) -> None:
    """Tells sizes, asks unless `yes`, deletes. Raises UserError where there is no such folder."""
    if not outputs.is_dir():
        raise UserError(f"There is no folder {outputs}: name the folder of outputs.")
    found = old_days(outputs, older)
    if not found:
        print(f"{outputs}: {spelled(size_of(outputs))}, nothing of it by freelearn and older than {older:g} days.")
        return
    for one in found:
        print(f"  {spelled(one.size):>9}  {one.age:5.0f} days  {one.folder}")
    print(f"{spelled(sum(one.size for one in found))} of {spelled(size_of(outputs))}.")
    if not yes and (not sys.stdin.isatty() or input("Delete these? [y/N] ").strip().lower() not in ("y", "yes")):
        print("Nothing was deleted." + ("" if sys.stdin.isatty() else " Add --yes to delete them."))
        return
    for one in found:
        shutil.rmtree(one.folder)
    print(f"Deleted {len(found)} folders.")


def old_days(outputs: Path, older: float) -> list[Old]:
    """Folders COMMAND/DAY, none of whose files is younger than `older` days. Links are neither followed nor named."""
    now, found = time.time(), []
    for folder in sorted(outputs.glob("*/*")):
        if not DAY.fullmatch(folder.name) or folder.is_symlink() or folder.parent.is_symlink() or not folder.is_dir():
            continue
        files = [path for path in folder.rglob("*") if not path.is_symlink()]
        last = max((path.stat().st_mtime for path in [folder, *files]), default=now)
        age = (now - last) / SECONDS
        if age >= older:
            found.append(Old(folder, size_of(folder), age))
    return found


def size_of(folder: Path) -> int:
    """Bytes of the files in a folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink())


def spelled(size: float) -> str:
    """A size as people read it.

    >>> spelled(999), spelled(2_340_000)
    ('999 B', '2.3 MB')
    """
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" or size >= 100 else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} TB"


# `doctor`: what is installed, on which machine, and what is optional and absent.

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


def doctor_main() -> None:
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
