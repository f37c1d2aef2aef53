"""What a format gives back once it has written an actuator."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from freelearn.export.round_trip import Answers

# What float64 leaves of the model's own numbers, as a share of the range: more is no rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Written:
    """files: in the folder, the first the one to use. answers: of its function `loads`, None where nothing here can run
    it. limit: largest difference allowed, a share of the range. outside: what happens beyond the data. notes: what else
    to know. more: further figures for the certificate."""

    files: list[Path]
    answers: Answers | None
    outside: str
    limit: float = ROUNDING
    notes: list[str] = field(default_factory=list)
    more: dict[str, Any] = field(default_factory=dict)
