"""Where a result comes from: its data, its seed, its split."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Provenance:
    """What was looked at. name: of the data configuration. seed: of a simulated bed; path, sha256: of a file.

    >>> Provenance.from_plain({"name": "virtual", "simulated": True, "seed": 3}).sentence()
    'Data: simulated bed, seed 3. Nothing in it was measured.'
    """

    name: str
    simulated: bool
    seed: int | None = None
    path: str = ""
    sha256: str = ""

    @classmethod
    def from_plain(cls, entry: Mapping[str, Any]) -> Provenance:
        """The source that `plain` wrote; unknown keys are passed over."""
        known = {key: entry[key] for key in ("name", "seed", "path", "sha256") if key in entry}
        return cls(simulated=bool(entry["simulated"]), **known)

    def plain(self) -> dict[str, Any]:
        """The entry `data` of results.json and discovery.json."""
        if self.simulated:
            return {"name": self.name, "simulated": True, "seed": self.seed}
        return {"name": self.name, "simulated": False, "path": self.path, "sha256": self.sha256}

    def sentence(self) -> str:
        """The source in words."""
        if self.simulated:
            return f"Data: simulated bed, seed {self.seed}. Nothing in it was measured."
        return f"Data: {self.path}, SHA-256 {self.sha256}"

    @property
    def words(self) -> str:
        """What stands beside numbers: simulated data, or measured data."""
        return "simulated data" if self.simulated else "measured data"


@dataclass(frozen=True)
class Origin:
    """What a run's numbers depend on besides its model, sets and fit. split: rows or states. key: digest of all
    settings, data and code, "" where none is kept."""

    provenance: Provenance
    seed: int
    split: str
    key: str = ""

    def plain(self) -> dict[str, Any]:
        """The entries in results.json."""
        return {"seed": self.seed, "split": self.split, "data": self.provenance.plain(), "key": self.key}
