"""The package itself: where it lies, with what, which version it is, and which code made a result's numbers."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1]
VERSION = "0.2.0"
# In an installed package the configuration files lie inside it, in a checkout beside it.
CONF = next((path for path in (FOLDER / "conf", FOLDER.parent / "conf") if path.is_dir()), FOLDER / "conf")
# A path that begins like this is that of a measured example in the package.
EXAMPLE, EXAMPLES = "example:", FOLDER / "examples"


def example(text: str) -> Path:
    """Where a table lies: at a path, or among the package's examples."""
    return EXAMPLES / text.removeprefix(EXAMPLE) if text.startswith(EXAMPLE) else Path(text)


# Rooms of the package that a fit's numbers come from; pictures and terminal output cannot change them.
ROOMS = ("data", "physics", "fitting")


@lru_cache
def code_version(rooms: tuple[str, ...] = ROOMS) -> str:
    """Digest of the package's code in these rooms, by default of those that a fit's numbers come from."""
    root = FOLDER
    digest = hashlib.sha256()
    for room in rooms:
        for path in sorted((root / room).rglob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
