"""Where a job's process begins. Light to import: the page's own process names it, without what the job needs."""

from __future__ import annotations

from multiprocessing.connection import Connection
from pathlib import Path


def start(kind: str, overrides: list[str], command: str, folder: Path, fits: Path, pipe: Connection) -> None:
    """Runs `freelearn.workbench.work.work`."""
    from freelearn.workbench.work import work

    work(kind, overrides, command, folder, fits, pipe)
