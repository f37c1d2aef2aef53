"""What is shown of long work that a function does, where somebody looks on: a terminal or a notebook."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rich.console import Console

from freelearn.common.progress import tell, watched
from freelearn.report.terminal.long_work import LongWork, NotebookBar, in_notebook

if TYPE_CHECKING:
    from lightning import Callback

    from freelearn.fitting.options import FitOptions


class Shown:
    """A context with a bar on it; silent in scripts whose output goes to a file, and where none is wanted."""

    def __init__(self, what: str, wanted: bool) -> None:
        self.stack = ExitStack()
        self.bar: LongWork | NotebookBar | None = None
        if wanted:
            # Not among what a script prints.
            self.bar = NotebookBar(what) if in_notebook() else LongWork(Console(stderr=True), f"{what}…")

    def __enter__(self) -> Shown:
        if self.bar is not None:
            self.stack.enter_context(self.bar)
            self.stack.enter_context(watched(self.bar))
        return self

    def __exit__(self, *_: object) -> None:
        self.stack.close()

    def epochs(self, fit: FitOptions | None) -> Callable[[], Callback] | None:
        """Makes what is told of a fit's epochs, once there is a fit to make; None where nobody looks on."""
        if self.bar is None or fit is None:
            return None
        return lambda: _epochs(fit.max_epochs)


def _epochs(most: int) -> Callback:
    # Here, not above: Lightning takes seconds to import.
    from freelearn.report.terminal.fit_progress import Epochs

    def told(epoch: int, train: float, validation: float) -> None:
        tell(f"epoch {epoch}, E {100 * train:.3g} % on the training rows", epoch, most)

    return Epochs(told)
