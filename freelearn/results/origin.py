"""Where a result comes from: its data, its seed, its split."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter, ValidationError

from freelearn.errors import UserError


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
