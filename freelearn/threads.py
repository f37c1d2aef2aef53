"""How many cores one fit uses."""

from __future__ import annotations

import os

import torch


def one_thread() -> None:
    """Has torch compute on one thread, unless OMP_NUM_THREADS says otherwise.

    Rows are taken in blocks that fit the processor's cache, so a second thread gains nothing; and where another
    process holds the second core, two threads wait for each other and everything becomes many times slower. One
    thread also gives the same numbers whatever launched the run.
    """
    if not os.environ.get("OMP_NUM_THREADS"):
        torch.set_num_threads(1)
