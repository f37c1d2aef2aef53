"""How far long work has come, in a terminal or a notebook."""

from __future__ import annotations

import sys
import time
from html import escape
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class ProfileProgress:
    """A bar of the ends that are known, from the first word of them on; silent where the output is not a terminal.

    It is a context, which takes the bar away.
    """

    def __init__(self, console: Console | None) -> None:
        columns = (TextColumn("profiles"), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        disabled = console is None or not console.is_terminal
        self.bar = Progress(*columns, console=console, transient=True, disable=disabled)
        self.task = self.bar.add_task("", total=None, start=False)

    def __enter__(self) -> ProfileProgress:
        return self

    def __call__(self, name: str, done: int, total: int) -> None:
        """Shows the parameter whose ends are looked for, how many ends are known, and of how many."""
        if not self.bar.live.is_started:
            self.bar.start()
            self.bar.start_task(self.task)
        self.bar.update(self.task, completed=done, total=total, description=f"{name}: {done} of {total} ends")

    def __exit__(self, *_: object) -> None:
        self.bar.stop()


# What the terminal shows of work that takes its time.

# A bar comes once the work has taken so long [s]; before that, and where nobody tells how far it is, what is done.
SOON = 1.0


class LongWork:
    """Says what is done, with a bar where it takes long; silent where the output is not a terminal.

    It is a context, which takes all of it away, and what is told of `work.watched`."""

    def __init__(self, console: Console | None, what: str) -> None:
        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self.shown = console is not None and console.is_terminal
        self.bar = Progress(*columns, console=console, transient=True, disable=not self.shown)
        self.status = console.status(what) if console and self.shown else None
        self.began = time.monotonic()

    def __enter__(self) -> LongWork:
        if self.status:
            self.status.start()
        return self

    def __call__(self, what: str, done: int, total: int) -> None:
        """Shows how much of some work is done."""
        if not self.status or time.monotonic() - self.began < SOON:
            return
        if not self.bar.live.is_started:
            self.status.stop()
            self.bar.start()
            self.task = self.bar.add_task(what)
        self.bar.update(self.task, description=what, completed=done, total=total)

    def __exit__(self, *_: object) -> None:
        if self.status:
            self.bar.stop()
            self.status.stop()


# What a notebook shows of work that takes its time: a bar, gone when the work is done.

# A bar comes once the work has taken so long, and changes no more often than that [s].
BAR_SOON, EVERY = 1.0, 0.2


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell: Any = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


class NotebookBar:
    """A context, and what is told of `work.watched`."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.display: Any = None
        self.next = 0.0

    def __enter__(self) -> NotebookBar:
        self.next = time.monotonic() + BAR_SOON
        return self

    def __call__(self, what: str, done: int, total: int) -> None:
        """Shows how much of some work is done."""
        if time.monotonic() < self.next:
            return
        self.next = time.monotonic() + EVERY
        bar = f'<progress value="{done}" max="{max(total, 1)}"></progress> {escape(f"{self.what}: {what}")}'
        self._show(bar)

    def __exit__(self, *_: object) -> None:
        if self.display is not None:
            self._show("")

    def _show(self, html: str) -> None:
        shown: Any = sys.modules["IPython.display"]
        if self.display is None:
            self.display = shown.display(shown.HTML(html), display_id=True)
        else:
            self.display.update(shown.HTML(html))
