"""The shell command that gives a run's numbers again."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

# Variables that name files of the user's own code.
OWN_CODE = ("FREELEARN_EFFECTS", "FREELEARN_MODELS")


def command_line(program: Sequence[str], overrides: Sequence[str]) -> str:
    """`program overrides`, with the user's own effects and models where there are some."""
    own = [f"{name}={shlex.quote(value)}" for name in OWN_CODE if (value := os.environ.get(name))]
    return " ".join([*own, *program, *map(shlex.quote, overrides)])


def program(name: str, script: Sequence[str] = ()) -> list[str]:
    """How a command is started as this process was: by the installed `freelearn name`, or else by `script`.

    script: by default a checkout's `python name.py`.
    """
    installed = Path(sys.argv[0]).name.startswith("freelearn ")
    return ["freelearn", name] if installed else list(script) or ["python", f"{name}.py"]
