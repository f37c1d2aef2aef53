"""Files of effects that a search of the session wrote, named like the user's own."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from freelearn.commands.command_line import OWN_CODE

EFFECTS_VARIABLE = OWN_CODE[0]


@contextmanager
def named(files: Sequence[str]) -> Iterator[None]:
    """Meanwhile the environment names these files, after those that it names already."""
    before = os.environ.get(EFFECTS_VARIABLE)
    if files:
        known = [path for path in (before or "").split(os.pathsep) if path]
        os.environ[EFFECTS_VARIABLE] = os.pathsep.join(dict.fromkeys([*known, *files]))
    try:
        yield
    finally:
        if before is not None:
            os.environ[EFFECTS_VARIABLE] = before
        elif files:
            del os.environ[EFFECTS_VARIABLE]
