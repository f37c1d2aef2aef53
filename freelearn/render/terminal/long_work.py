"""What the terminal shows of work that takes its time."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

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
