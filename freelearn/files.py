"""Files that are whole or absent."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Calls `write` on a name beside `path`, then renames: readers see all of the file or none."""
    # The process number keeps two runs that write the same file out of each other's unfinished ones.
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(beside)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8 text, whole or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Writes bytes, whole or not at all."""

    def write(beside: Path) -> None:
        beside.write_bytes(content)

    write_whole(path, write)


def remove_empty(folder: Path) -> None:
    """Removes a command's folder and those made for it under outputs/, as far as there is nothing in them."""
    outputs = Path.cwd() / "outputs"
    made = [path for path in folder.parents if path == outputs or outputs in path.parents]
    for empty in (folder, *(made or [folder.parent])):
        if empty.is_dir() and not any(empty.iterdir()):
            empty.rmdir()
