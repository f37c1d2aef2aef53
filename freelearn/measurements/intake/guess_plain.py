"""A guess as plain values, for a page that shows it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter

from freelearn.measurements.intake.guessed import Guess
from freelearn.measurements.intake.joined import DesignGuess


@dataclass(frozen=True)
class Guessed:
    """A guess with the designs that are joined with it."""

    found: Guess
    joined: DesignGuess | None = None

    def plain(self) -> dict[str, Any]:
        """For JSON, which has no NaN."""
        plain: dict[str, Any] = json.loads(_adapter().dump_json(self))
        return plain

    @classmethod
    def from_plain(cls, content: dict[str, Any]) -> Guessed:
        """The same again. Raises ValueError where it is none."""
        return _adapter().validate_python(_with_nan(content))


def _with_nan(content: Any) -> Any:
    """The same with the range of a text as it was."""
    if isinstance(content, dict):
        return {k: math.nan if v is None and k in ("low", "high") else _with_nan(v) for k, v in content.items()}
    return [_with_nan(one) for one in content] if isinstance(content, list) else content


@lru_cache(maxsize=1)
def _adapter() -> TypeAdapter[Guessed]:
    return TypeAdapter(Guessed)
