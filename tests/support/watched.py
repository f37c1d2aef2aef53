"""What a process asks of the system, written down as it asks: connections, other processes, code, pickles, files."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from types import CodeType
from typing import Any

WATCHED = (
    "subprocess.Popen",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.spawn",
    "pickle.find_class",
    "urllib.Request",
)


def watch(log: str, folder: str) -> None:
    """Writes a line of JSON to `log` for every such event from now on, in forked processes too. It cannot be undone.

    folder: code that comes from a file in it is told as well, and of files opened for writing those outside it.
    """
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    first, busy = os.getpid(), False

    def hook(event: str, given: tuple[Any, ...]) -> None:
        nonlocal busy
        if busy:
            return
        busy = True
        try:
            if (told := _told(event, given, folder)) is not None:
                line = {"event": event, "given": told, "forked": os.getpid() != first}
                os.write(descriptor, (json.dumps(line) + "\n").encode())
        finally:
            busy = False

    sys.addaudithook(hook)


def _told(event: str, given: tuple[Any, ...], folder: str) -> list[str] | None:
    if event.startswith("socket.") and event != "socket.__new__":
        return [repr(value) for value in given[1:]] if event != "socket.gethostname" else None
    if event in WATCHED:
        return [repr(value)[:300] for value in given]
    if event == "exec" and isinstance(given[0], CodeType) and Path(folder) in Path(given[0].co_filename).parents:
        return [given[0].co_filename]
    if event == "open" and isinstance(given[0], str) and given[2] & (os.O_WRONLY | os.O_RDWR):
        path = os.path.abspath(given[0])
        return None if path.startswith((folder, "/dev/", "/proc/")) else [path]
    return None


def events(log: Path) -> list[dict[str, Any]]:
    """What was written down."""
    return [json.loads(line) for line in log.read_text().splitlines()]
