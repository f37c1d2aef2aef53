"""The fits that a search has made, kept so that one which is taken up again makes none of them twice."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import TypedDict, TypeVar

from freelearn.common.cores import cores, side_by_side

T = TypeVar("T")

# A fit takes milliseconds: what is lost with so many seconds is made again in as many.
SECONDS = 0.5


class Ending(TypedDict):
    """How a fit ended. vector: raw parameters (p,). status: of a Termination. message: how it came to that."""

    vector: list[float]
    status: int
    message: str


class Entry(TypedDict):
    """A fit that was made. asked: digest of what it was about."""

    asked: str
    ending: Ending


class Journal:
    """A search's fits, by what they are about.

    The same question makes a search ask for the same fits. One that is repeated from its beginning therefore finds here
    what the interrupted one had done, and ends as if nothing had happened, to the last bit, on any number of cores:
    only how fits end is taken from here, all that follows from it is computed once more."""

    def __init__(
        self, entries: Sequence[Entry] = (), keep: Callable[[Sequence[Entry]], None] = lambda entries: None
    ) -> None:
        """entries: of the interrupted search. keep: given all entries, at most once in so many seconds."""
        self.entries, self.keep, self._kept = {e["asked"]: e["ending"] for e in entries}, keep, time.monotonic()

    def ended(self, asked: str, fit: Callable[[], Ending]) -> Ending:
        """How a fit ended, or ends now."""
        if asked not in self.entries:
            self.add(asked, fit())
        return self.entries[asked]

    def add(self, asked: str, ending: Ending) -> None:
        """Takes over how a fit ended."""
        self.entries[asked] = ending
        if time.monotonic() - self._kept > SECONDS:
            self.keep([Entry(asked=a, ending=e) for a, e in self.entries.items()])
            self._kept = time.monotonic()


_present: ContextVar[Journal | None] = ContextVar("journal", default=None)


@contextmanager
def kept_in(journal: Journal) -> Iterator[None]:
    """All fits made inside go through the journal."""
    before = _present.set(journal)
    try:
        yield
    finally:
        _present.reset(before)


def ended(asked: str, fit: Callable[[], Ending]) -> Ending:
    """How a fit ends: by the present journal where there is one."""
    journal = _present.get()
    return journal.ended(asked, fit) if journal else fit()


@contextmanager
def kept() -> Iterator[None]:
    """All fits made inside go through a journal: the present one, or one for as long as this lasts."""
    if _present.get():
        yield
        return
    with kept_in(Journal()):
        yield


def together(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """What each job returns, in their order, side by side on all cores. The fits that they make are in the journal
    then, wherever they were made."""
    journal = _present.get()
    if journal is None or min(cores(), len(jobs)) < 2:
        return side_by_side(jobs)
    out = []
    for value, made in side_by_side([partial(_apart, journal.entries, job) for job in jobs]):
        for asked, ending in made.items():
            if asked not in journal.entries:
                journal.add(asked, ending)
        out.append(value)
    return out


def ahead(jobs: Sequence[Callable[[], object]]) -> None:
    """Has the fits of some jobs made side by side, so that each job finds them in the journal when it is done. Nothing
    on one core, or without a journal."""
    if _present.get() is not None and min(cores(), len(jobs)) > 1:
        together([partial(_nothing, job) for job in jobs])


def _apart(known: dict[str, Ending], job: Callable[[], T]) -> tuple[T, dict[str, Ending]]:
    """What a job returns, and the fits that it made: in a journal that nobody keeps."""
    own = Journal()
    own.entries = dict(known)
    with kept_in(own):
        value = job()
    return value, {asked: ending for asked, ending in own.entries.items() if asked not in known}


def _nothing(job: Callable[[], object]) -> None:
    job()
