"""What a notebook shows of work that takes its time: a bar, gone when the work is done."""

from __future__ import annotations

import sys
import time
from html import escape
from typing import Any

# A bar comes once the work has taken so long, and changes no more often than that [s].
SOON, EVERY = 1.0, 0.2


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
        self.next = time.monotonic() + SOON
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
