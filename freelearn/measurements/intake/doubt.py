"""Something that the numbers of a laboratory's file leave open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

YES, NO = "yes", "no"
YES_OR_NO = ((YES, "yes"), (NO, "no"))


@dataclass(frozen=True)
class Doubt:
    """text: the question; short: what it is about. options: answer → its words. proposed: the answer that is likely, if
    one is. of: column of the file → the meaning that it must have. changes: answer → what the recipe has more, plain
    values. rows: whether it is about which rows there are."""

    key: str
    text: str
    short: str
    options: tuple[tuple[str, str], ...] = YES_OR_NO
    proposed: str | None = None
    of: Mapping[str, str] = field(default_factory=dict)
    changes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    rows: bool = False
