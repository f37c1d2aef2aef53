"""Which code made a result's numbers."""

from __future__ import annotations

import hashlib
from functools import lru_cache

from freelearn.package import FOLDER

# Rooms of the package that a fit's numbers come from; pictures and terminal output cannot change them.
ROOMS = ("measurements", "mechanics", "models", "fitting")


@lru_cache
def code_version(rooms: tuple[str, ...] = ROOMS) -> str:
    """Digest of the package's code in these rooms, by default of those that a fit's numbers come from."""
    root = FOLDER
    digest = hashlib.sha256()
    for room in rooms:
        for path in sorted((root / room).rglob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
