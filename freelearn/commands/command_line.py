"""The shell command that gives a run's numbers again."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence


def command_line(program: Sequence[str], overrides: Sequence[str]) -> str:
    """`python program overrides`, with the user's own effects where there are some."""
    own = os.environ.get("FREELEARN_EFFECTS")
    start = [f"FREELEARN_EFFECTS={shlex.quote(own)}"] if own else []
    return " ".join([*start, "python", *program, *map(shlex.quote, overrides)])
