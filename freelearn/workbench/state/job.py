"""A fit or a discovery in a process of its own, so that the page never waits and can stop it."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from freelearn.workbench.state.question import Question


def start(kind: str, question: Question, folder: Path, fits: Path, pipe: Connection) -> None:
    """Runs `freelearn.workbench.state.job_work.work`."""
    # Here, not above: see the first line.
    from freelearn.workbench.state.job_work import work

    work(kind, question, folder, fits, pipe)


# Forked from a process that has imported everything, a job starts at once; where there is no fork it imports first.
CONTEXT: Any = multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")


def warm_up() -> None:
    """Starts the process that jobs are forked from."""
    if sys.platform != "win32":
        from multiprocessing.forkserver import ensure_running

        CONTEXT.set_forkserver_preload(["freelearn.workbench.state.job_work"])
        ensure_running()


class Job:
    """status: running, done, failed or canceled. text: the latest progress or what went wrong. share: 0…1, or None
    while the length is unknown."""

    def __init__(self, kind: str, question: Question, folder: Path, fits: Path) -> None:
        self.kind, self.folder, self.status = kind, folder, "running"
        self.text, self.share = "starting", None
        self.pipe, theirs = CONTEXT.Pipe(duplex=False)
        arguments = (kind, question, folder, fits, theirs)
        self.process = CONTEXT.Process(target=start, args=arguments, daemon=True)
        self._theirs = theirs
        # The first one waits seconds for the process that it is forked from: nobody's page waits with it.
        self._starting = threading.Thread(target=self._start, daemon=True)
        self._starting.start()

    def _start(self) -> None:
        self.process.start()
        self._theirs.close()

    def poll(self) -> bool:
        """Takes in what the process has said; whether there was anything."""
        if self.status != "running":
            return False
        before = self.status, self.text, self.share
        if self._starting.is_alive():
            return False
        ended = not self.process.is_alive()
        try:
            while self.pipe.poll():
                self._hear(*self.pipe.recv())
        except EOFError:
            ended = True
        if ended and self.status == "running":
            self.status = "failed"
            self.text = f"its process ended (exit code {self.process.exitcode}); see {self.folder / 'log.txt'}"
        return before != (self.status, self.text, self.share)

    def _hear(self, what: str, content: Any) -> None:
        if what == "progress":
            self.text, self.share = content["text"], content.get("share")
        else:
            self.status, self.text = what, content

    def cancel(self) -> None:
        """Kills the process. What a discovery has found so far stays, and the same question goes on from there."""
        if self.status == "running":
            self._starting.join()
            self.process.kill()
            self.process.join()
            self.status, self.text = "canceled", "canceled"
