"""What Hydra calls around a multirun. Imported at every start, so everything heavy is imported when it is needed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback

from freelearn.commands.ending import one_sentence
from freelearn.commands.hold import hold


class HoldFolder(Callback):
    """Lets one command write to a folder at a time: before Hydra's own files in it are replaced."""

    def on_run_start(self, config: Any, **_: Any) -> None:
        """Of a single run."""
        with one_sentence("interrupted before it began."):
            hold(Path(config.hydra.run.dir), "hydra.run.dir")

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Of a sweep: its jobs write into folders of this one."""
        with one_sentence("interrupted before it began."):
            hold(Path(config.hydra.sweep.dir), "hydra.sweep.dir")


class WatchWorkers(Callback):
    """Has the workers of a sweep on several cores end with it, also where it is killed."""

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Before the launcher starts them."""
        if "joblib" in str(config.hydra.launcher["_target_"]):
            from freelearn.commands.worker import watch_workers

            watch_workers()


class GatherSweep(Callback):
    """Gathers a multirun's results when it ends; exit code 1 when jobs failed."""

    def on_multirun_start(self, config: Any, **_: Any) -> None:
        """Says where the sweep's files go."""
        print(f"sweep: {config.hydra.sweep.dir} (the same command with hydra.sweep.dir=… resumes it)", flush=True)

    def on_multirun_end(self, config: Any, **_: Any) -> None:
        """Gathers; exits with code 1 where jobs failed."""
        from rich.console import Console

        from freelearn.commands.command_line import command_line, program
        from freelearn.commands.gather import gather_folders

        folder = Path(config.hydra.sweep.dir)
        command = command_line([*program("train"), "-m"], config.hydra.overrides.task)
        with one_sentence(f"interrupted; the same command with hydra.sweep.dir={folder} goes on from here."):
            failed = gather_folders([folder], folder, Console(), command)
        if failed:
            sys.exit(f"error: {failed} jobs failed: see the column error in {folder / 'heatmap.csv'}")
