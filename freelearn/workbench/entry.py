"""Where a job's process begins. Light to import: the page's own process names it, without what the job needs."""

from __future__ import annotations

from multiprocessing.connection import Connection
from pathlib import Path

from freelearn.workbench.question import Question


def start(kind: str, question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """Runs `freelearn.workbench.work.work`."""
    # Here, not above: see the first line.
    from freelearn.workbench.work import work

    work(kind, question, folder, fits, pipe)
