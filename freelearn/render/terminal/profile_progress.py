"""Progress in the terminal while profiles look for the ends of intervals."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn


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
