"""A folder held by one command, so that no second one writes into it at the same time."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from freelearn.common.errors import UserError, cannot_write

# Folders that this process holds, by device and number; their open descriptors hold them until it ends.
_HELD: dict[tuple[int, int], Path] = {}


def hold(folder: Path, option: str) -> None:
    """Makes the folder and holds it until this process ends, however it ends; nothing is left behind in it.

    option: the override that names the folder. Raises UserError where it cannot be made, or another process holds it.
    Where the system locks no folders (Windows, some network drives) nothing is held.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        seen = folder.stat()
    except (OSError, ValueError) as problem:
        raise cannot_write(folder, problem, f"choose another folder by {option}=…") from None
    if (seen.st_dev, seen.st_ino) in _HELD:
        return
    try:
        import fcntl
    except ImportError:
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise UserError(
            f"{folder} is being written by another command: wait until that has ended, or choose another folder by "
            f"{option}=…"
        ) from None
    except OSError:
        os.close(descriptor)
        return
    _HELD[(seen.st_dev, seen.st_ino)] = folder


def leave_nothing(folder: Path | None = None) -> None:
    """Removes what Hydra wrote of a command that ended before it began: its files, and folders that are then empty.

    folder: by default those that this process holds. One in which anything else lies stays as it is.
    """
    for place in list(_HELD.values()) if folder is None else [folder]:
        with suppress(OSError):
            if {path.name for path in place.glob("*")} - {".hydra", "multirun.yaml"}:
                continue
            for path in (*(place / ".hydra").glob("*.yaml"), place / "multirun.yaml"):
                path.unlink(missing_ok=True)
        for empty in (place / ".hydra", place, place.parent):
            # Not there, not empty, or not ours to remove.
            with suppress(OSError):
                empty.rmdir()
