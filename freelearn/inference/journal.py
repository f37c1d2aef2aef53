"""The fits that a search has made, kept so that one which is taken up again makes none of them twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypedDict


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
    """A search's fits, in the order in which it makes them.

    The same question makes a search ask for the same fits in the same order. One that is repeated from its beginning
    therefore finds here what the interrupted one had done, and ends as if nothing had happened, to the last bit: only
    how fits end is taken from here, all that follows from it is computed once more."""

    def __init__(
        self, entries: Sequence[Entry] = (), keep: Callable[[Sequence[Entry]], None] = lambda entries: None
    ) -> None:
        """entries: of the interrupted search. keep: given all entries after each fit that is made."""
        self.entries, self.keep, self.taken = list(entries), keep, 0

    def ended(self, asked: str, fit: Callable[[], Ending]) -> Ending:
        """How the next fit ended, or ends now."""
        if self.taken == len(self.entries) or self.entries[self.taken]["asked"] != asked:
            # Where something else is asked for, the rest is of no use.
            self.entries[self.taken :] = [Entry(asked=asked, ending=fit())]
            self.keep(self.entries)
        self.taken += 1
        return self.entries[self.taken - 1]["ending"]


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
