"""What the referee says of a run that has ended, and its file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from freelearn.files import write_text
from freelearn.inference.referee.check import Check
from freelearn.results.formats import all_finite
from freelearn.results.referee_file import REFEREE


@dataclass(frozen=True)
class RefereedRun:
    """claimed: what the run's search would claim, empty for a run of train; verdict: what stands of it. visible: by
    effect and parameter, the smallest size (SI) that such a table would show. simulated: the tally of searches of
    simulated tables, empty where none were asked for; told: the same in words."""

    folder: Path
    claimed: str
    verdict: str
    checks: Sequence[Check]
    visible: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    simulated: Mapping[str, Any] = field(default_factory=dict)
    told: Sequence[str] = ()

    def write(self) -> None:
        """referee.json in the run's folder."""
        checks = [check.plain() for check in self.checks]
        content: dict[str, Any] = {
            "claimed": self.claimed,
            "verdict": self.verdict,
            "checks": checks,
            "visible": self.visible,
        }
        if self.simulated:
            content["simulated"] = {**self.simulated, "says": list(self.told)}
        write_text(self.folder / REFEREE, json.dumps(all_finite(content), indent=2, allow_nan=False) + "\n")
