"""The measurement table that a command's settings name, and a digest of everything that its results depend on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.api.settings.settings import CsvData, DataSettings, Settings, TrainSettings, VirtualData, plain
from freelearn.common.errors import UserError
from freelearn.common.files import add_to_digest, write_text
from freelearn.common.package import code_version
from freelearn.data.beds import BEDS
from freelearn.data.table.measurement_table import TableFile, read_table
from freelearn.data.table.members_table import read_members
from freelearn.physics.models.own_files import own_files
from freelearn.physics.simulated_bed import Hidden, hidden_effects, simulate
from freelearn.records.provenance import Provenance

# Tables kept in memory, so that the jobs of a sweep in one process read or simulate each of them once.
KEPT = 4


@dataclass(frozen=True)
class LoadedTable:
    """A checked measurement table, shared between callers: none may change it in place.

    lines: the line of each row in its file, or in the one that a simulated table would be written to, (N,) int64.
    warnings: sentences about it."""

    table: pd.DataFrame
    lines: np.ndarray
    warnings: tuple[str, ...]
    provenance: Provenance


def load_table(data: DataSettings) -> LoadedTable:
    """The table, from its file or simulated. Raises UserError."""
    if isinstance(data, VirtualData):
        table = _simulated(_bed(data))
        return LoadedTable(table, np.arange(len(table)) + 2, (), Provenance("virtual", True, seed=data.seed))
    before = _stamp(data.path)
    digest = data_version(data)
    read = _read(str(data.path), digest, data.bed, None if data.members is None else str(data.members))
    if before != _stamp(data.path):
        raise UserError(f"{data.path} changed while it was read: start again once nothing writes to it.")
    provenance = Provenance("csv", False, path=str(data.path), sha256=digest)
    return LoadedTable(read.table, read.lines, tuple(read.warnings), provenance)


def data_version(data: DataSettings) -> str:
    """SHA-256 of the table's file (and of its members'); empty for simulated data, which their settings determine, and
    for unreadable files."""
    return _digest(*filter(None, (data.path, data.members))) if isinstance(data, CsvData) else ""


def _digest(*paths: Path) -> str:
    """SHA-256 of the files, one after the other; empty where one cannot be read."""
    digest = hashlib.sha256()
    try:
        for path in paths:
            add_to_digest(digest, path)
        return digest.hexdigest()
    except UserError:
        return ""  # reading it says what is wrong with the file


def seal(data: DataSettings, folder: Path) -> None:
    """Keeps what data.hidden=random drew in a file of its own, which nothing else reads."""
    if isinstance(data, VirtualData) and data.hidden == "random":
        answer = {"hidden": _hidden(data)}
        write_text(folder / "sealed_answer.json", json.dumps(answer, indent=2) + "\n")


def _hidden(data: VirtualData) -> Hidden:
    return hidden_effects(data.hidden, data.seed)


def _bed(data: VirtualData) -> str:
    """What the simulated bed depends on, as a key."""
    if data.accuracy is None:
        raise UserError("data.accuracy=estimate is for measured data: the simulated bed needs to know its noise.")
    effects = data.truth_effects if data.hidden is None else _hidden(data)
    parts = {"truth": data.truth, "effects": effects, "accuracy": vars(data.accuracy)}
    return json.dumps(parts | {"buckled_share": data.buckled_share, "seed": data.seed})


def _stamp(path: Path) -> tuple[int, ...]:
    """What changes with a file; empty where it cannot be looked at."""
    try:
        of = path.stat()
    except (OSError, ValueError):
        return ()
    return of.st_ino, of.st_size, of.st_mtime_ns


@lru_cache(KEPT)
def _simulated(bed: str) -> pd.DataFrame:
    known = json.loads(bed)
    return simulate(known["truth"], known["effects"], known["accuracy"], known["buckled_share"], known["seed"])


@lru_cache(KEPT)
def _read(path: str, digest: str, bed: str, members: str | None) -> TableFile:
    return read_table(path, BEDS[bed], None if members is None else read_members(members))


# Rooms of the package that results come from; pictures and terminal output cannot change them.
ROOMS = ("data", "physics", "fitting", "discovery", "records", "queries", "api")


def job_key(settings: Settings) -> str:
    """24 digits: of the settings, the data, the user's own effects and models, a specimen's constants and the code."""
    parts = [type(settings).__name__, json.dumps(plain(settings), sort_keys=True)]
    parts += [data_version(settings.data), code_version(ROOMS)]
    parts += [_digest(path) for path in own_files()]
    if isinstance(settings, TrainSettings) and settings.constituent is not None:
        parts.append(_digest(settings.constituent))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:24]
