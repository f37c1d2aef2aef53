"""Workers of a sweep that runs on several cores: none outlives the sweep."""

from __future__ import annotations

import os
import threading
import time
from typing import Any

# How often a worker looks whether the sweep still runs [s].
EVERY = 0.5


def end_with(parent: int) -> None:
    """Ends this process soon after the one that started it, however that ended: one that is killed tells nobody.

    What was being written is left unfinished, for the next command in its folder to remove. parent: its number, and not
    asked for here: it may have gone before this process came so far.
    """

    def watch() -> None:
        # A process whose parent is gone gets another one.
        while os.getppid() == parent:
            time.sleep(EVERY)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def watch_workers() -> None:
    """From here on every worker that joblib starts watches over its parent, also one that is given no job."""
    from joblib import register_parallel_backend
    from joblib.parallel import LokyBackend

    class Watching(LokyBackend):  # type: ignore[misc]
        """Its workers end with their parent."""

        def configure(self, *arguments: Any, **options: Any) -> Any:
            """As joblib's own, which passes the initializer on to its workers."""
            watching = {"initializer": end_with, "initargs": (os.getpid(),)}
            return super().configure(*arguments, **watching, **options)

    # By the name under which the launcher asks for it.
    register_parallel_backend("loky", Watching)
