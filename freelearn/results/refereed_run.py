"""What the referee says of a run that has ended, and its file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.files import write_text
from freelearn.inference.referee.check import Check
from freelearn.results.claim_tables import check_lines
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

    def frame(self) -> pd.DataFrame:
        """The checks: each with its result, figure, threshold and what it says."""
        return pd.DataFrame([check.plain() for check in self.checks])

    def summary(self) -> str:
        """What stands, and what the checks say that did not pass."""
        stands = f"{self.claimed} was claimed: {self.verdict} stands." if self.claimed else "Nothing was claimed."
        return "\n".join([stands, *check_lines([check.plain() for check in self.checks]), *self.told])

    def _repr_html_(self) -> str:
        said = escape(self.summary().split("\n")[0])
        return f"<p>{said}</p>{self.frame()[['name', 'result', 'says']].to_html(index=False, border=0)}"

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
