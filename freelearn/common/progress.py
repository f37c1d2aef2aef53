"""How far a long piece of work has come, told to whoever looks on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# What is done, how much of it, and of how much.
ProgressCallback = Callable[[str, int, int], None]
# Steps of which a work is taken to be half done, where how many there will be is known at its end only.
HALF_DONE = 25
TOTAL = 1000


class _Watcher:
    def __init__(self, told: ProgressCallback) -> None:
        self.told, self.steps = told, 0


_watchers: ContextVar[tuple[_Watcher, ...]] = ContextVar("watchers", default=())


@contextmanager
def watched(told: ProgressCallback) -> Iterator[None]:
    """Within it, `told` hears of the work that is done, beside those that look on already."""
    before = _watchers.set((*_watchers.get(), _Watcher(told)))
    try:
        yield
    finally:
        _watchers.reset(before)


@contextmanager
def unwatched() -> Iterator[None]:
    """Within it nobody hears of the work that is done."""
    before = _watchers.set(())
    try:
        yield
    finally:
        _watchers.reset(before)


def tell(what: str, done: int, total: int) -> None:
    """Says how much of some work is done, to whoever looks on.

    >>> with watched(lambda what, done, total: print(f"{what}: {done} of {total}")):
    ...     tell("reading", 1, 2)
    reading: 1 of 2
    >>> tell("reading", 2, 2)
    """
    for watcher in _watchers.get():
        watcher.told(what, done, total)


def begin(what: str) -> None:
    """Says which step comes next, of how many nobody knows: what counts as done never falls, nor is it ever all.

    >>> with watched(lambda what, done, total: print(f"{what}: {done / total:.0%}")):
    ...     for name in ("one", "two", "three"):
    ...         begin(name)
    one: 0%
    two: 3%
    three: 5%
    """
    for watcher in _watchers.get():
        watcher.told(what, round(TOTAL * (1 - 0.5 ** (watcher.steps / HALF_DONE))), TOTAL)
        watcher.steps += 1
