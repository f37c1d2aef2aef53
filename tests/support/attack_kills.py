"""Commands that are killed at a chosen one of their file operations, and what they leave compared bit by bit.

`arm` is executed by the server of forked commands: with KILL_AT=n in its environment a command kills itself (SIGKILL)
before the n-th operation that would change a file under KILL_UNDER. Where that is a rename, half of what was written is
cut off first: as if it had been killed while it wrote. KILL_COUNT=FILE has it write there how many there were.
"""

from __future__ import annotations

import atexit
import json
import os
import re
import signal
import sys
from pathlib import Path
from typing import Any

from freelearn.common.files import UNFINISHED

ARM = "import attack_kills; attack_kills.arm()"
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
# What by its nature is of the moment: times, in documents; TensorBoard's files, which hold them in every record; and
# the names that Bokeh makes up for the charts of a page.
TIMES = {"seconds", "fit_seconds", "fit_reused"}
EVENTS, PROGRESS = "events.out.tfevents.", "progress.json"
MADE_UP = re.compile(rb"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


def arm() -> None:
    """Counts every operation that changes a file from now on, in this process and in those forked from it."""
    done = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal done
        if event not in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir"):
            return
        under = os.environ.get("KILL_UNDER")
        if not under or not str(arguments[0]).startswith(under):
            return
        if event == "open" and not (arguments[2] or 0) & WRITES:
            return
        done += 1
        if done == 1 and "KILL_COUNT" in os.environ:
            atexit.register(lambda: Path(os.environ["KILL_COUNT"]).write_text(str(done)))
        if done == int(os.environ.get("KILL_AT", 0)):
            if event == "os.rename" and Path(arguments[0]).is_file():
                os.truncate(arguments[0], os.path.getsize(arguments[0]) // 2)
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def contents(folder: Path) -> dict[str, Any]:
    """What every file under a folder says, by its place in it; but for times."""
    return {
        str(path.relative_to(folder)): told(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.startswith(EVENTS)
    }


def told(path: Path) -> Any:
    """A file's bytes; of a document in JSON what it says without times, of a page without made-up names."""
    content = path.read_bytes()
    if path.suffix == ".json":
        return without_times(json.loads(content))
    if path.suffix == ".fit":
        return fit(path)
    return MADE_UP.sub(b"", content) if path.suffix == ".html" else content


def differing(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Places of which two folders say different things."""
    return sorted(place for place in one.keys() | other.keys() if one.get(place) != other.get(place))


def without_times(content: Any) -> Any:
    """A document's values."""
    if isinstance(content, dict):
        return {name: without_times(value) for name, value in content.items() if name not in TIMES}
    return [without_times(value) for value in content] if isinstance(content, list) else content


def fit(path: Path) -> dict[str, Any]:
    """What a kept fit holds, its tensors as bytes."""
    from io import BytesIO

    import torch

    def plain(value: Any) -> Any:
        if isinstance(value, torch.Tensor):
            return value.numpy().tobytes()
        if isinstance(value, dict):
            return {name: plain(each) for name, each in value.items() if name not in TIMES}
        return repr(value)

    from freelearn.fitting.store import DIGEST

    return dict(plain(torch.load(BytesIO(path.read_bytes()[DIGEST:]), weights_only=True)))


def leftovers(folder: Path) -> list[str]:
    """Files of ours that no command that has ended leaves: unfinished ones, locks, the progress of a search."""
    return [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and (UNFINISHED.fullmatch(path.name) or path.suffix == ".lock" or path.name == "progress.json")
    ]


def events(folder: Path) -> dict[str, int]:
    """How many of TensorBoard's files there are, by folder."""
    found: dict[str, int] = {}
    for path in folder.rglob(f"{EVENTS}*"):
        name = str(path.parent.relative_to(folder))
        found[name] = found.get(name, 0) + 1
    return found
