"""Folders of this Python session, for what nobody has named a folder for: gone when the session ends."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from functools import lru_cache
from itertools import count
from pathlib import Path

_NUMBERS = count(1)


def session_folder(name: str) -> Path:
    """The folder of this name in this session's; the same name gives the same folder."""
    # By the process: a fork has a folder of its own, and removes no other.
    return _root(os.getpid()) / name


def new_folder(kind: str) -> Path:
    """A folder that this session has not had."""
    return session_folder(f"{kind}-{next(_NUMBERS)}")


@lru_cache
def _root(process: int) -> Path:
    root = Path(tempfile.mkdtemp(prefix="freelearn-"))

    def remove() -> None:
        if os.getpid() == process:
            shutil.rmtree(root, ignore_errors=True)

    atexit.register(remove)
    return root
