"""Memory that is free, given back to the system."""

from __future__ import annotations

import ctypes


def give_back() -> None:
    """Has the C library let go what was freed: of large tables it keeps hundreds of megabytes for later, while what is
    made next needs them. Nothing where the library is not GNU's."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, AttributeError, TypeError):
        return
