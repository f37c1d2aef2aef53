"""Files that are whole or absent."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from freelearn.errors import cannot_write

# Names of files that are being written, or try whether a folder can be written to: with the number of their process.
UNFINISHED = re.compile(
    r"\.writable\.(?P<tried>\d+)|\..+\.(?P<written>\d+)\.(part|part\.csv|members\.csv|provenance\.json)"
)


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Calls `write` on a name beside `path`, then renames: readers see all of the file or none. Raises UserError where
    the system refuses, and leaves what was there."""
    # The process number keeps two runs that write the same file out of each other's unfinished ones.
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(beside)
        os.replace(beside, path)
    except OSError as problem:
        raise cannot_write(
            path, problem, "choose another folder, and leave it until the command has ended"
        ) from problem
    finally:
        # What could not be written may not be removable either.
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8 text, whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Writes bytes, whole or not at all."""

    def write(beside: Path) -> None:
        beside.write_bytes(content)

    write_whole(path, write)


def remove_unfinished(folder: Path) -> None:
    """Removes what killed commands had begun to write in a folder, for a command that begins to write there."""
    for path in folder.glob(".*"):
        began = UNFINISHED.fullmatch(path.name)
        if began and not _lives(int(began["tried"] or began["written"])):
            with suppress(OSError):
                path.unlink()


def _lives(process: int) -> bool:
    """Whether another process of this number runs; on Windows, where that cannot be asked, always."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # another user's
    return process != os.getpid()


def remove_empty(folder: Path) -> None:
    """Removes a command's folder and those made for it under outputs/, as far as there is nothing in them."""
    outputs = Path.cwd() / "outputs"
    made = [path for path in folder.parents if path == outputs or outputs in path.parents]
    for empty in (folder, *(made or [folder.parent])):
        # Not empty, gone, or not ours to remove.
        with suppress(OSError):
            empty.rmdir()
