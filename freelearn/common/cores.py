"""Cores and memory: independent computations side by side, with the same results on any number of cores."""

from __future__ import annotations

import ctypes
import io
import os
import pickle
import signal
import struct
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, NamedTuple, TypeVar

import torch
from torch import Tensor

from freelearn.common.progress import unwatched

# What a computation asks of the machine: how many cores, and what becomes of memory that is free.

# Names of glibc's mallopt, from malloc.h.
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
# Free memory that is kept, and the largest block that is taken from it (glibc allows no larger one) [bytes].
KEPT, LARGEST = 2**28, 2**25


def configure_runtime() -> None:
    """One thread, and memory that is kept from one operation to the next. Commands call it before they compute."""
    limit_threads()
    # Each step of a fit makes and drops the same tensors of some megabytes. Given back to the system each time, they
    # come again as a thousand pages to clear: a tenth of a search's time.
    _asked("mallopt", M_TRIM_THRESHOLD, KEPT)
    _asked("mallopt", M_MMAP_THRESHOLD, LARGEST)


def limit_threads() -> None:
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


# Independent computations side by side on the machine's cores, with the same results on any number of them.

T = TypeVar("T")
# Environment variable with the most cores that a computation may take.
CORES = "FREELEARN_CORES"
# From linux/prctl.h: the signal that a process is sent when its parent ends.
PR_SET_PDEATHSIG = 1
# A job's number, as it stands in the pipe that jobs are taken from; and how many fit into a pipe at once.
NUMBER = struct.Struct("=I")
MOST = 4096

_most: ContextVar[int | None] = ContextVar("cores", default=None)


@contextmanager
def limited(cores: int | None) -> Iterator[None]:
    """Within it no more cores are taken; None for all that there are."""
    before = _most.set(cores)
    try:
        yield
    finally:
        _most.reset(before)


def cores() -> int:
    """Cores that a computation may take: all that this process may run on, unless `limited` or FREELEARN_CORES says
    otherwise.

    >>> with limited(1):
    ...     cores()
    1
    """
    # Where a process cannot be copied, where torch cannot differentiate in a copy (it has a thread for each GPU), or
    # where it shares its work among threads, which a copy lacks and would wait for without end (OMP_NUM_THREADS=2).
    if sys.platform != "linux" or torch.cuda.is_available() or torch.get_num_threads() > 1:
        return 1
    asked = _most.get() or os.environ.get(CORES, "")
    there = len(os.sched_getaffinity(0))
    return max(1, min(there, int(asked))) if str(asked).isdigit() else there


def side_by_side(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """What each job returns, in their order.

    Jobs run in copies of this process, which share all that it has in memory; what they return must be picklable, and
    what else they change is lost. A job that fails in a copy is done once more here, so that its error is raised.

    >>> side_by_side([lambda: 1, lambda: 2])
    [1, 2]
    """
    count = min(cores(), len(jobs))
    if count < 2 or len(jobs) > MOST:
        return [job() for job in jobs]
    take, put = os.pipe()
    os.write(put, b"".join(NUMBER.pack(number) for number in range(len(jobs))))
    os.close(put)
    copies: list[_Copy] = []
    done: dict[int, T] = {}
    try:
        copies += [_copied(jobs, take) for _ in range(count - 1)]
        # The cores are taken: what a job would do side by side it does in turn.
        with limited(1):
            for number in _taken(take):
                done[number] = jobs[number]()
        for copy in copies:
            done |= copy.results()
    finally:
        os.close(take)
        for copy in copies:
            copy.end()
    return [done[number] if number in done else job() for number, job in enumerate(jobs)]


class _Copy(NamedTuple):
    """A copy of this process that does jobs. out: where what they return can be read."""

    process: int
    out: int

    def results(self) -> dict[int, Any]:
        """What its jobs returned, by their numbers; nothing of one that ended otherwise than by itself."""
        with open(self.out, "rb", closefd=False) as file:
            content = file.read()
        with suppress(pickle.UnpicklingError, EOFError):
            found: dict[int, Any] = pickle.loads(content)  # of this process's own copy, through a pipe
            return found
        return {}

    def end(self) -> None:
        """Leaves nothing of it behind."""
        os.close(self.out)
        with suppress(ProcessLookupError):
            os.kill(self.process, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(self.process, 0)


def _copied(jobs: Sequence[Callable[[], Any]], take: int) -> _Copy:
    out, into = os.pipe()
    here = os.getpid()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        # Python ≥ 3.12 warns of threads, of which a copy has none: those of progress bars and pages are not waited for.
        warnings.simplefilter("ignore", DeprecationWarning)
        process = os.fork()
    if process:
        os.close(into)
        return _Copy(process, out)
    try:
        # The one that was copied is interrupted, and ends its copies.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        _end_with(here)
        os.close(out)
        done: dict[int, Any] = {}
        with limited(1), unwatched():
            for number in _taken(take):
                # Its error is raised where it is done once more.
                with suppress(Exception):
                    done[number] = jobs[number]()
        with open(into, "wb") as file:
            file.write(_pickled(done))
    finally:
        os._exit(0)


def _end_with(parent: int) -> None:
    """Ends this copy with the process that was copied: one that is killed cannot end it, and what both have open, a
    folder's lock among it, is let go by the last of them."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    # It may be gone already.
    if os.getppid() != parent:
        os._exit(1)


def _taken(take: int) -> Iterator[int]:
    """Numbers of jobs that nobody else does."""
    while number := os.read(take, NUMBER.size):
        yield NUMBER.unpack(number)[0]


class _Pickler(pickle.Pickler):
    """Tensors as arrays: torch's own way costs as much as a small fit."""

    def reducer_override(self, value: Any) -> Any:
        if type(value) is Tensor:
            return torch.from_numpy, (value.detach().numpy(),)
        return NotImplemented


def _pickled(value: Any) -> bytes:
    file = io.BytesIO()
    _Pickler(file, protocol=pickle.HIGHEST_PROTOCOL).dump(value)
    return file.getvalue()
