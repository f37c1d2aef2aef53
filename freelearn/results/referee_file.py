"""referee.json: the checks of a claim, beside what claimed it."""

from __future__ import annotations

import json
from pathlib import Path

from freelearn.files import write_text
from freelearn.inference.search import Findings
from freelearn.results.formats import all_finite

REFEREE = "referee.json"


def write_referee(findings: Findings, folder: Path) -> None:
    """What was claimed, what of it stands, and every check with its figure and threshold. Nothing where none was
    made."""
    if findings.referee is None:
        (folder / REFEREE).unlink(missing_ok=True)
        return
    checks = [check.plain() for check in findings.referee.checks]
    content = {"claimed": findings.claimed, "verdict": findings.verdict, "checks": checks}
    write_text(folder / REFEREE, json.dumps(all_finite(content), indent=2, allow_nan=False) + "\n")
