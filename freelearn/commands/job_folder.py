"""The folder of a sweep's job: named after what it does, and found again by its number."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

# Letters of a name: systems allow 255 bytes, and a training set may name dozens of samples.
LONGEST = 80


def named_folder(folder: Path, number: int, asked: Mapping[str, Any]) -> Path:
    """The job's folder under its name, such as continuum_sample3_seed0_7, with all that it held under another one.

    folder: Hydra's, called by the number alone; one that the user named otherwise stays as it is. A sweep of an older
    version, or the same one with another seed, left this number's results under another name: they are this job's, to
    be kept or replaced. Raises OSError.
    """
    if folder.name != str(number):
        return folder
    named = folder.with_name(f"{job_name(asked)}_{number}")
    others = [
        path.parent for mark in ("results.json", "error.json") for path in folder.parent.glob(f"*_{number}/{mark}")
    ]
    for earlier in [*dict.fromkeys(others), folder]:
        if earlier != named:
            _move(earlier, named)
    return named


def job_name(asked: Mapping[str, Any]) -> str:
    """What a job is called in folders and in TensorBoard.

    >>> job_name({"model": "continuum", "effects": ["end_clamps"], "train": "sample3", "seed": 0})
    'continuum+end_clamps_sample3_seed0'
    """
    what = "+".join([str(asked["model"]), *map(str, asked["effects"])])
    name = re.sub(r"[^\w+.-]+", "_", f"{what}_{asked['train']}")
    return f"{name[:LONGEST]}_seed{asked['seed']}"


def _move(earlier: Path, named: Path) -> None:
    """Moves what lies in a folder into another, over what has the same name there; the folder is gone then."""
    named.mkdir(parents=True, exist_ok=True)
    for entry in earlier.iterdir():
        place = named / entry.name
        if place.is_dir():
            shutil.rmtree(place)
        os.replace(entry, place)
    earlier.rmdir()
