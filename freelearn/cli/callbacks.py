"""What Hydra calls around a multirun. Imported at every start, so everything heavy is imported when it is needed."""

from __future__ import annotations

import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback

from freelearn.cli.command_line import exit_on_user_error
from freelearn.cli.hold import hold

# Workers of a sweep that runs on several cores: none outlives the sweep.

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


class HoldFolder(Callback):
    """Lets one command write to a folder at a time: before Hydra's own files in it are replaced."""

    def on_run_start(self, config: Any, **_: Any) -> None:
        """Of a single run."""
        with exit_on_user_error("interrupted before it began."):
            hold(Path(config.hydra.run.dir), "hydra.run.dir")

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Of a sweep: its jobs write into folders of this one."""
        with exit_on_user_error("interrupted before it began."):
            hold(Path(config.hydra.sweep.dir), "hydra.sweep.dir")


class WatchWorkers(Callback):
    """Has the workers of a sweep on several cores end with it, also where it is killed."""

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Before the launcher starts them."""
        if "joblib" in str(config.hydra.launcher["_target_"]):
            watch_workers()


class GatherSweep(Callback):
    """Gathers a multirun's results when it ends; exit code 1 when jobs failed."""

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Says where the sweep's files go."""
        print(f"sweep: {config.hydra.sweep.dir} (the same command with hydra.sweep.dir=… resumes it)", flush=True)

    def on_multirun_end(self, config: Any, **_: Any) -> None:
        """Gathers; exits with code 1 where jobs failed."""
        from rich.console import Console

        from freelearn.cli.command_line import command_line, program, resumed
        from freelearn.cli.gathering import gather_folders

        folder = Path(config.hydra.sweep.dir)
        command = command_line([*program("train"), "-m"], config.hydra.overrides.task)
        with exit_on_user_error(f"interrupted; {resumed('hydra.sweep.dir', folder)}."):
            failed = gather_folders([folder], folder, Console(), command)
        if failed:
            sys.exit(f"error: {failed} jobs failed: see the column error in {folder / 'heatmap.csv'}")
