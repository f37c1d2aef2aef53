"""Where a result comes from, and whether its files are as they were written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from freelearn.common.errors import UserError

# Whether the files of a run are as they were written: results.json and discovery.json hold digests of the others.

# Under these names a document holds its own digest, and those of files beside it by their names.
OWN, OTHERS = "digest", "files"
# What a document's own digest leaves out: how long it took, which differs between runs that are the same.
TIMES = ("seconds", "fit_seconds", "fit_reused")
# Bytes of a large file that are read at once.
BLOCK = 1 << 20


def with_digests(content: Mapping[str, Any], folder: Path, names: Iterable[str] = ()) -> dict[str, Any]:
    """The document with digests of the named files beside it, and of itself."""
    others = {name: _of_file(folder / name) for name in names}
    whole = {**content, OTHERS: others} if others else dict(content)
    return {**whole, OWN: _of_content(whole)}


def as_written(content: Mapping[str, Any]) -> bool:
    """Whether a document's own digest fits. One without a digest is an older one, or a user's own."""
    return OWN not in content or _of_content(content) == content[OWN]


def read_document(path: Path) -> dict[str, Any]:
    """A JSON object from a file. Raises UserError where it is none, or not as it was written."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"There is no file {path}: make the run again.") from None
    except (OSError, ValueError, RecursionError) as problem:
        raise UserError(f"{path} cannot be read ({problem}): make the run again.") from None
    if not isinstance(content, dict):
        raise UserError(f"{path} is no JSON object: make the run again.")
    if not as_written(content):
        raise UserError(f"{path} is not as it was written, {OWN!r} in it does not fit: make the run again.")
    return content


def check_files(content: Mapping[str, Any], folder: Path) -> None:
    """Raises UserError where a file beside a document is missing, or not the one that the document was written with."""
    stated = content.get(OTHERS)
    for name, digest in stated.items() if isinstance(stated, dict) else ():
        try:
            same = _of_file(folder / name) == digest
        except OSError as problem:
            raise UserError(f"{folder / name} cannot be read ({problem.strerror}): make the run again.") from None
        if not same:
            raise UserError(f"{folder / name} is not as the run wrote it: make the run again.")


def _of_file(path: Path) -> str:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _of_content(content: Mapping[str, Any]) -> str:
    """Of all but the digest itself and times, whatever the order and the white space."""
    plain = json.loads(json.dumps({name: value for name, value in content.items() if name not in (OWN, *TIMES)}))
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


# Where a result comes from: its data, its seed, its split.


@dataclass(frozen=True)
class Provenance:
    """Where a table came from. simulated: nothing in it was measured; then seed is the bed's, else path and sha256 are
    the file's.

    >>> Provenance.from_plain({"name": "virtual", "simulated": True, "seed": 3}).sentence()
    'Data: simulated bed, seed 3. Nothing in it was measured.'
    """

    name: str
    simulated: bool
    seed: int | None = None
    path: str | None = None
    sha256: str | None = None

    @classmethod
    def from_plain(cls, entry: Mapping[str, Any]) -> Provenance:
        """The provenance that `plain` wrote, without what is not known here. Raises UserError for what is none."""
        try:
            known: Provenance = TypeAdapter(cls).validate_python(entry)
        except ValidationError:
            raise UserError("A result does not say which data it is about, in its entry data: make it again.") from None
        return known

    def plain(self) -> dict[str, Any]:
        """What results.json and discovery.json say of it."""
        return {name: value for name, value in vars(self).items() if value is not None}

    def sentence(self) -> str:
        """The provenance in words."""
        if self.simulated:
            return f"Data: simulated bed, seed {self.seed}. Nothing in it was measured."
        return f"Data: {self.path}, SHA-256 {self.sha256}"

    @property
    def kind(self) -> str:
        """What stands beside numbers: simulated data, or measured data."""
        return "simulated data" if self.simulated else "measured data"


@dataclass(frozen=True)
class Origin:
    """What a run's numbers depend on besides its model, sets and fit.

    split: rows or states. shares: of training and of validation rows. device: where the fit computed. key: digest of
    all settings, data and code, "" where none is kept. notes: sentences on how accurate the measuring was."""

    provenance: Provenance
    seed: int
    split: str
    shares: tuple[float, float]
    device: str = "cpu"
    key: str = ""
    notes: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """The entries in results.json."""
        entries: dict[str, Any] = {"seed": self.seed, "split": self.split}
        entries |= {"shares": dict(zip(("train", "validation"), self.shares, strict=True)), "device": self.device}
        entries |= {"data": self.provenance.plain(), "key": self.key}
        return entries | ({"notes": list(self.notes)} if self.notes else {})
