"""What a computation asks of the machine: how many cores, and what becomes of memory that is free."""

from __future__ import annotations

import ctypes
import os

import torch

# Names of glibc's mallopt, from malloc.h.
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
# Free memory that is kept, and the largest block that is taken from it (glibc allows no larger one) [bytes].
KEPT, LARGEST = 2**28, 2**25


def made_ready() -> None:
    """One thread, and memory that is kept from one operation to the next. Commands call it before they compute."""
    one_thread()
    # Each step of a fit makes and drops the same tensors of some megabytes. Given back to the system each time, they
    # come again as a thousand pages to clear: a tenth of a search's time.
    _asked("mallopt", M_TRIM_THRESHOLD, KEPT)
    _asked("mallopt", M_MMAP_THRESHOLD, LARGEST)


def one_thread() -> None:
    """Has torch compute on one thread, unless OMP_NUM_THREADS says otherwise.

    Rows are taken in blocks that fit the processor's cache, so a second thread gains nothing; and where another
    process holds the second core, two threads wait for each other and everything becomes many times slower. One
    thread also gives the same numbers whatever launched the run.
    """
    if not os.environ.get("OMP_NUM_THREADS"):
        torch.set_num_threads(1)


def give_back() -> None:
    """Has the C library let go what was freed: of large tables it keeps hundreds of megabytes for later, while what is
    made next needs them."""
    _asked("malloc_trim", 0)


def _asked(function: str, *arguments: int) -> None:
    """Calls a function of the C library; nothing where that is not GNU's."""
    try:
        getattr(ctypes.CDLL(None), function)(*arguments)
    except (OSError, AttributeError, TypeError):
        return
