"""One job of a multirun: done once, never fatal to the sweep, in a folder named after what it does."""

from __future__ import annotations

import json
import os
import re
import shutil
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from freelearn.api.settings.parse import parse
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.loaded_table import job_key
from freelearn.api.tasks.train_task import train
from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import write_text
from freelearn.physics.models.own_files import load_own_code
from freelearn.records.provenance import check_files, read_document
from freelearn.records.run import Run
from freelearn.records.sweep_records import ERROR_FILE
from freelearn.report.terminal.printed_tables import print_words

# The folder of a sweep's job: named after what it does, and found again by its number.

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


# One job of a multirun: done once, and never fatal to the sweep.


def sweep_job(config: Mapping[str, Any], number: int, folder: Path, command: str) -> float | None:
    """Runs a job unless its folder already holds its results; returns E on its training set, where that is tested.

    folder: Hydra's; see named_folder. config: composed, as plain values. A combination named in `exclude` is left out.
    Any failure, a mistake in the configuration included, ends up in error.json beside the other jobs' results.
    """
    console = Console(soft_wrap=True)
    asked = _asked(config)
    label = f"job {number:<3} {asked['model']:<10} {asked['train']:<12}"
    if any(_matches(config, combination) for combination in config["exclude"] or []):
        return None
    try:
        folder = named_folder(folder, number, asked)
        load_own_code()
        settings = parse(TrainSettings, config)
        key = job_key(settings)
        if (kept := _results(folder)) and kept.get("key") == key:
            console.print(f"{label} done before", highlight=False)
            return _own_error(kept["tests"], settings.train)
        (folder / ERROR_FILE).unlink(missing_ok=True)
        run = train(settings, folder, key=key, command=command)
    except UserError as mistake:
        _fail(folder, console, label, asked, str(mistake))
        return None
    except OSError as refusal:
        _fail(folder, console, label, asked, str(cannot_write(refusal.filename or folder, refusal)))
        return None
    except Exception as problem:
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "traceback.txt", traceback.format_exc())
        _fail(folder, console, label, asked, f"{type(problem).__name__}: {problem}")
        return None
    error = _own_error({name: e.plain() for name, e in run.errors.items()}, settings.train)
    console.print(f"{label} {_summary(run, error)}", highlight=False)
    return error


def _asked(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the job was to do, in the words of results.json; also where the configuration is faulty."""
    train = config["train"]
    return {
        "model": config["model"]["name"],
        "train": "+".join(map(str, train)) if isinstance(train, list) else str(train),
        "test": config["test"],
        "fit": config["fit"]["name"],
        "split": config["split"]["name"],
        "effects": config["effects"] or [],
        "seed": config["seed"],
    }


def _matches(config: Mapping[str, Any], combination: Mapping[str, Any]) -> bool:
    """Whether every override of the combination is set; a group is named by its option."""
    chosen = {k: v["name"] if isinstance(v, Mapping) and "name" in v else v for k, v in config.items()}
    return all(chosen.get(name) == value for name, value in combination.items())


def _results(folder: Path) -> dict[str, Any] | None:
    """What a job before left, None where any of it is damaged."""
    try:
        content = read_document(folder / "results.json")
        check_files(content, folder)
    except UserError:
        return None
    return content


def _fail(folder: Path, console: Console, label: str, asked: Mapping[str, Any], message: str) -> None:
    (folder / "results.json").unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / ERROR_FILE, json.dumps({**asked, "error": message}, indent=2) + "\n")
    print_words(console, f"{label} failed: {message}")


def _own_error(tests: Mapping[str, Mapping[str, Any]], train_set: str) -> float | None:
    """E on the training set's own test rows, or on the only test set; what a sweeper may minimize."""
    names = [train_set] if train_set in tests else list(tests)
    return tests[names[0]]["E"] if len(names) == 1 else None


def _summary(run: Run, error: float | None) -> str:
    scored = f"E {100 * error:6.2f} %" if error is not None else ""
    source = "fit reused" if run.reused else ""
    return f"{scored}  {run.seconds:5.1f} s  {source}".rstrip()
